/// Tests that neither the node nor the nodelet starts with invalid parameters, and that the log
/// names every invalid parameter.
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sys/wait.h>

#include <cstdio>
#include <string>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {
namespace {

struct Outcome {
  int exit_code = -1;
  std::string output;
};

Outcome run(const std::string& command) {
  Outcome outcome;
  FILE* pipe = popen(("timeout 20 " + command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return outcome;
  char buffer[4096];
  while (std::fgets(buffer, sizeof(buffer), pipe) != nullptr) outcome.output += buffer;
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

bool isLoaded(const std::string& name) { return ros::service::exists(name + "/save_mesh", false); }

class FailingStart : public testing::TestWithParam<std::string> {
 protected:
  Outcome start(const std::string& name) { return run(GetParam() + " __name:=" + name); }
};

TEST_P(FailingStart, NamesEveryWrongKeyInTheLog) {
  ros::param::set("/wrong/map/voxel_size_m", -1.0);
  ros::param::set("/wrong/fusion/mode", "guess");
  ros::param::set("/wrong/mesh/color", "normal");
  ros::param::set("/wrong/input/queue_size", "many");
  ros::param::set("/wrong/publish/mesh_rate_hz", std::vector<double>{1.0, 2.0});
  const Outcome outcome = start("wrong");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_FALSE(isLoaded("/wrong"));
  EXPECT_NE(outcome.output.find("FATAL"), std::string::npos) << outcome.output;
  for (const char* key : {"map/voxel_size_m", "fusion/mode", "mesh/color", "input/queue_size",
                          "publish/mesh_rate_hz", "/wrong"}) {
    EXPECT_NE(outcome.output.find(key), std::string::npos) << key << " is not in:\n"
                                                           << outcome.output;
  }
  ros::param::del("/wrong");
}

TEST_P(FailingStart, IgnoresParametersOfRos) {
  ros::param::set("/fine/image_transport", "raw");
  ros::param::set("/fine/diagnostic_period", 1.0);
  ros::param::set("/fine/compressedDepth/depth_max", 10.0);
  // set by plugins that publish rendered/image
  ros::param::set("/fine/rendered/image/compressed/jpeg_quality", 80);
  ros::param::set("/fine/map/voxel_size_m", 1);  // an integer is accepted for a float
  ros::param::set("/fine/map/max_memory_mb", 1.5);
  const Outcome outcome = start("fine");
  EXPECT_NE(outcome.output.find("map/max_memory_mb"), std::string::npos) << outcome.output;
  for (const char* key :
       {"image_transport", "diagnostic_period", "depth_max", "jpeg_quality", "voxel_size_m"}) {
    EXPECT_EQ(outcome.output.find(std::string(key) + " ="), std::string::npos) << outcome.output;
  }
  ros::param::del("/fine");
}

TEST_P(FailingStart, UnavailableCudaIsAnError) {
  const std::string reason = cudaUnavailableReason();
  if (reason.empty()) GTEST_SKIP() << "CUDA is available on this machine";
  ros::param::set("/cuda/backend", "cuda");
  const Outcome outcome = start("cuda");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_FALSE(isLoaded("/cuda"));
  EXPECT_NE(outcome.output.find("FATAL"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find(reason), std::string::npos) << outcome.output;
  ros::param::del("/cuda");
}

TEST_P(FailingStart, AMissingMapIsAnError) {
  ros::param::set("/mapless/map/load_file", "/not/there.dtsdf");
  const Outcome outcome = start("mapless");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_NE(outcome.output.find("'/not/there.dtsdf'"), std::string::npos) << outcome.output;
  ros::param::del("/mapless");
}

/// The error must be logged before the last node handle is destroyed, because that ends logging.
TEST(Arguments, WrongCameraParametersAreNamed) {
  ros::param::set("/camera/rate_hz", std::string("often"));
  ros::param::set("/camera/widht_px", 640);
  const Outcome outcome = run(std::string(DTSDF_SIMULATED_CAMERA) + " __name:=camera");
  EXPECT_EQ(outcome.exit_code, 1);
  for (const char* text : {"FATAL", "/camera cannot start", "rate_hz = 'often': must be a number",
                           "widht_px = 640", "rosparam delete"}) {
    EXPECT_NE(outcome.output.find(text), std::string::npos) << text << " is not in:\n"
                                                            << outcome.output;
  }
  ros::param::del("/camera");
}

/// ROS takes `rate_hz:=5` for a topic remapping and would abort because 5 is not a valid name.
TEST(Arguments, MissingUnderscoresAreReported) {
  EXPECT_EQ(run(std::string(DTSDF_SIMULATED_CAMERA) + " rate_hz:=5").exit_code, 2);
  const Outcome node = run(std::string(DTSDF_MAPPING_NODE) + " map/voxel_size_m:=0.05");
  EXPECT_EQ(node.exit_code, 2);
  EXPECT_NE(node.output.find("_map/voxel_size_m:=0.05"), std::string::npos) << node.output;
  EXPECT_EQ(run(std::string(DTSDF_MAPPING_NODE) + " rate:=5").exit_code, 2);
}

// The node is started by path, because rosrun does not search the build folder.
INSTANTIATE_TEST_SUITE_P(Programs, FailingStart,
                         testing::Values(DTSDF_MAPPING_NODE,
                                         "rosrun nodelet nodelet standalone "
                                         "dtsdf_mapping/MappingNodelet"),
                         [](const auto& info) { return info.index == 0 ? "Node" : "Nodelet"; });

}  // namespace
}  // namespace dtsdf
