/// The program around SimulatedCamera.
#include <ros/ros.h>

#include <exception>
#include <string>
#include <vector>

#include "ros/common/node_start.h"
#include "ros/simulation/simulated_camera.h"

namespace {

constexpr char kUsage[] =
    "usage: rosrun dtsdf_mapping simulated_camera [_SETTING:=VALUE...] [TOPIC:=OTHER_TOPIC...]\n\n"
    "Publishes depth and colour images of a simulated room, with camera_info and TF, for the\n"
    "demo and for tests. Needs a ROS master.\n\n"
    "Topics: depth/image_rect, depth/camera_info, color/image_rect, color/camera_info, /tf,\n"
    "/tf_static.\n";

dtsdf::SimulatedCameraParams readParams(const dtsdf::ServerParams& server) {
  dtsdf::SimulatedCameraParams params;
  dtsdf::ParamReader reader(server.tree);
  visitParams(params, reader);
  for (const auto& [key, rule] : server.violations) reader.addViolation(key, rule);
  for (const char* key : {"map_frame", "camera_frame", "color_frame"}) {
    const auto value = server.tree.find(key);
    if (value != server.tree.end() && value->second == dtsdf::ParamValue(std::string())) {
      reader.addViolation(key, "must not be empty");
    }
  }
  reader.finish();
  return params;
}

}  // namespace

int main(int argc, char** argv) {
  const auto defaults = dtsdf::defaultsOf<dtsdf::SimulatedCameraParams>();
  if (dtsdf::printHelp(argc, argv, kUsage, defaults)) return 0;
  const std::vector<std::string> arguments(argv, argv + argc);
  if (!dtsdf::initNode(argc, argv, "simulated_camera", defaults)) return 2;
  // ROS, and with it the log, ends with the last handle.
  const ros::NodeHandle nh, private_nh("~");
  const dtsdf::ServerParams server = dtsdf::readParamServer(private_nh);
  try {
    dtsdf::SimulatedCamera(nh, readParams(server)).run();
  } catch (const dtsdf::ParamError& error) {
    const std::string name = ros::this_node::getName();
    ROS_FATAL_STREAM(name << " cannot start: " << dtsdf::startErrorText(error)
                          << dtsdf::leftoversText(arguments, name, server.tree, defaults));
    return 1;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(ros::this_node::getName()
                     << " cannot start: " << dtsdf::startErrorText(error));
    return 1;
  }
  return 0;
}
