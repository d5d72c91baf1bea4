/// Helpers for the node's services, parameters and output directory.
#pragma once

#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <ros/param.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "dtsdf_mapping/io/mesh_file.h"
#include "params/node_params.h"
#include "ros/common/node_start.h"
#include "ros/support/wait.h"
#include "support/temporary_folder.h"

namespace dtsdf {

/// The parameters of the node, read from the parameter server.
inline NodeParams nodeParams() {
  std::vector<ParamViolation> violations;
  return readNodeParams(readParamServer(ros::NodeHandle("/mapping"), violations));
}

/// Contents of the .ply file that save_mesh should write for a mesh.
inline std::string plyOf(const Mesh& mesh, MeshColour colour) {
  const TemporaryFolder folder;
  saveMesh(mesh, colour, folder / "mesh.ply");
  return readBytes(folder / "mesh.ply");
}

inline std::string outputFolder() {
  return ros::param::param<std::string>("/mapping/output_directory", "");
}

/// Path of the newest journal. Journals are named by time, so it is the last one in alphabetical
/// order.
inline std::string newestJournalIn(const std::string& folder) {
  std::string newest;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".dtsdfj") newest = std::max(newest, entry.path().string());
  }
  return newest;
}

/// Must be called at the end of a test suite.
inline void removeOutputFolder() { std::filesystem::remove_all(outputFolder()); }

inline void clearMap() {
  std_srvs::Trigger clear;
  ASSERT_TRUE(callService("/mapping/clear_map", clear));
  ASSERT_TRUE(clear.response.success);
}

inline void pauseMapping(bool on) {
  std_srvs::SetBool pause;
  pause.request.data = on;
  ASSERT_TRUE(callService("/mapping/pause", pause));
  ASSERT_TRUE(pause.response.success);
}

/// Calls a service of the node that takes a file name.
template <class Service>
typename Service::Response callFile(const std::string& service, const std::string& file_name) {
  Service call;
  call.request.file_name = file_name;
  EXPECT_TRUE(callService("/mapping/" + service, call));
  return call.response;
}

inline auto saveMesh(const std::string& file_name) {
  return callFile<dtsdf_mapping::SaveMesh>("save_mesh", file_name);
}

inline auto saveMapAs(const std::string& file_name) {
  return callFile<dtsdf_mapping::SaveMap>("save_map", file_name);
}

inline auto loadMapFrom(const std::string& file_name) {
  return callFile<dtsdf_mapping::LoadMap>("load_map", file_name);
}

}  // namespace dtsdf
