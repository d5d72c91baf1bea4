#include <gtest/gtest.h>
#include <ros/ros.h>

#include "ros/support/kept_topics.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "rostest");
  const ros::NodeHandle keeps_ros_running;
  const int result = RUN_ALL_TESTS();
  dtsdf::giveUpKeptTopics();
  return result;
}
