/// Waits for a condition while callbacks are served. Wall time: simulated time may stand still.
#pragma once

#include <ros/ros.h>

namespace dtsdf {

/// True as soon as `condition()` holds, false if it does not within the time.
template <class Condition>
bool waitUntil(Condition condition, double timeout_s = 20.0) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(timeout_s);
  while (ros::ok() && ros::WallTime::now() < end) {
    ros::spinOnce();
    if (condition()) return true;
    ros::WallDuration(0.005).sleep();
  }
  return false;
}

}  // namespace dtsdf
