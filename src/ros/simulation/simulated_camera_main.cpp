/// The program around SimulatedCamera.
#include <ros/ros.h>

#include <exception>

#include "ros/common/param_server.h"
#include "ros/simulation/simulated_camera.h"

namespace {

dtsdf::SimulatedCameraParams readParams() {
  const dtsdf::ServerParams server = dtsdf::readParamServer(ros::NodeHandle("~"));
  dtsdf::SimulatedCameraParams params;
  dtsdf::ParamReader reader(server.tree);
  visitParams(params, reader);
  for (const auto& [key, rule] : server.violations) reader.addViolation(key, rule);
  reader.finish();
  return params;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "simulated_camera");
  try {
    dtsdf::SimulatedCamera(ros::NodeHandle(), readParams()).run();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(ros::this_node::getName() << " cannot start: " << error.what());
    return 1;
  }
  return 0;
}
