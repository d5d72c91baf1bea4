/// The door for those who run it as a node of its own.
#include <ros/ros.h>

#include <exception>

#include "ros/common/start_error.h"
#include "ros/session/mapping_node.h"

int main(int argc, char** argv) {
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
