/// The door for those who run it as a node of its own.
#include <ros/ros.h>

#include <exception>

#include "ros/common/node_help.h"
#include "ros/common/start_error.h"
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
  ros::init(argc, argv, "mapping");
  const ros::NodeHandle nh;
  const ros::NodeHandle private_nh("~");
  try {
    const dtsdf::MappingNode node(nh, private_nh);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(private_nh.getNamespace()
                     << " cannot start: " << dtsdf::startErrorText(error));
    return 1;
  }
  return 0;
}
