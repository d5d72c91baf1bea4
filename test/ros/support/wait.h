/// Waits for conditions and services, in wall time, because simulated time may stand still.
#pragma once

#include <ros/ros.h>

#include <string>

namespace dtsdf {

/// Serves callbacks; returns true as soon as `condition()` holds, false on timeout.
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
/// tries only once, so failed calls are repeated.
template <class Service>
bool callService(const std::string& name, Service& call) {
  return waitUntil([&] { return ros::service::call(name, call); }, 2.0);
}

}  // namespace dtsdf
