/// The door for those who run it as a node of its own.
#include <ros/ros.h>

#include <exception>
#include <string>
#include <vector>

#include "ros/common/node_start.h"
#include "ros/session/mapping_node.h"

namespace {

constexpr char kUsage[] =
    "usage: rosrun dtsdf_mapping mapping_node [_SETTING:=VALUE...] [TOPIC:=OTHER_TOPIC...]\n\n"
    "Maps depth images as a directional TSDF. Needs a ROS master. Most users start\n"
    "roslaunch dtsdf_mapping mapping.launch, which reads config/default.yaml; docs/ros.md has\n"
    "topics, services and settings.\n";

}  // namespace

int main(int argc, char** argv) {
  const auto defaults = dtsdf::defaultsOf<dtsdf::MappingParams>();
  if (dtsdf::printHelp(argc, argv, kUsage, defaults)) return 0;
  const std::vector<std::string> arguments(argv, argv + argc);
  if (!dtsdf::initNode(argc, argv, "mapping", defaults)) return 2;
  const ros::NodeHandle nh;
  const ros::NodeHandle private_nh("~");
  try {
    const dtsdf::MappingNode node(nh, private_nh);
    ros::spin();
  } catch (const dtsdf::ParamError& error) {
    const std::string name = private_nh.getNamespace();
    const dtsdf::ParamTree on_server = dtsdf::readParamServer(private_nh).tree;
    ROS_FATAL_STREAM(name << " cannot start: " << dtsdf::startErrorText(error)
                          << dtsdf::leftoversText(arguments, name, on_server, defaults));
    return 1;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(private_nh.getNamespace()
                     << " cannot start: " << dtsdf::startErrorText(error));
    return 1;
  }
  return 0;
}
