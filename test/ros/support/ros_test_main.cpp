#include <gtest/gtest.h>
#include <ros/ros.h>

#include <cstdio>
#include <string>

#include "ros/support/kept_topics.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "rostest");
  const ros::NodeHandle keeps_ros_running;
  const int result = RUN_ALL_TESTS();
  dtsdf::releaseKeptTopics();
  if (testing::UnitTest::GetInstance()->test_to_run_count() > 0) return result;
  // A filter that matches no test is a mistake. Removing the results file makes rostest fail.
  const std::string output = testing::GTEST_FLAG(output), kind = "xml:";
  if (output.rfind(kind, 0) == 0) std::remove(output.substr(kind.size()).c_str());
  return 1;
}
