/// What tests ask of the node by its services, and the folder that it saves into.
#pragma once

#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <ros/param.h>
#include <ros/service.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <filesystem>
#include <string>

namespace dtsdf {

/// For the end of a suite of tests.
inline void removeOutputFolder() {
  std::string folder;
  if (ros::param::get("/mapping/output_directory", folder)) std::filesystem::remove_all(folder);
}

inline void clearMap() {
  std_srvs::Trigger clear;
  ASSERT_TRUE(ros::service::call("/mapping/clear_map", clear));
  ASSERT_TRUE(clear.response.success);
}

inline void pauseMapping(bool on) {
  std_srvs::SetBool pause;
  pause.request.data = on;
  ASSERT_TRUE(ros::service::call("/mapping/pause", pause));
  ASSERT_TRUE(pause.response.success);
}

/// What a service of the node answers to the name of a file.
template <class Service>
typename Service::Response callFile(const std::string& service, const std::string& file_name) {
  Service call;
  call.request.file_name = file_name;
  EXPECT_TRUE(ros::service::call("/mapping/" + service, call));
  return call.response;
}

inline dtsdf_mapping::SaveMesh::Response saveMesh(const std::string& file_name) {
  return callFile<dtsdf_mapping::SaveMesh>("save_mesh", file_name);
}

}  // namespace dtsdf
