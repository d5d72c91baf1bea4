/// The folder that the node saves into, and what a test has it save there.
#pragma once

#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <ros/param.h>
#include <ros/service.h>

#include <filesystem>
#include <string>

namespace dtsdf {

/// For the end of a suite of tests.
inline void removeOutputFolder() {
  std::string folder;
  if (ros::param::get("/mapping/output_directory", folder)) std::filesystem::remove_all(folder);
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
