/// Waits for conditions and services in wall time, because simulated time may be stopped.
#pragma once

#include <ros/ros.h>

#include <string>

namespace dtsdf {

/// Runs callbacks until `condition()` holds. Returns false on timeout.
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

/// Calls a service, with retries, because roscpp may fail to reach the ROS master on a busy
/// machine. Thread-safe.
template <class Service>
bool callService(const std::string& name, Service& call) {
  for (int tries = 0; tries < 20; ++tries) {
    if (ros::service::call(name, call)) return true;
    ros::WallDuration(0.5).sleep();
  }
  return false;
}

}  // namespace dtsdf
