/// Waits for conditions and services. Wall time: simulated time may stand still.
#pragma once

#include <ros/ros.h>

#include <string>

namespace dtsdf {

/// Serves callbacks; true as soon as `condition()` holds, false if it does not within the time.
template <class Condition>
bool waitUntil(Condition condition, double timeout_s = 60.0) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(timeout_s);
  while (ros::ok() && ros::WallTime::now() < end) {
    ros::spinOnce();
    if (condition()) return true;
    ros::WallDuration(0.005).sleep();
  }
  return false;
}

/// Calls a service of the node. On a busy machine roscpp may fail to reach the ROS master, which it
/// asks only once, so a call that does not get through is tried again.
template <class Service>
bool callService(const std::string& name, Service& call) {
  return waitUntil([&] { return ros::service::call(name, call); }, 2.0);
}

}  // namespace dtsdf
