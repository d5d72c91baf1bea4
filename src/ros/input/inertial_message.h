/// From messages of inertial sensors to what is known of up.
#pragma once

#include <sensor_msgs/Imu.h>

#include <optional>

#include "level/still_gravity.h"

namespace dtsdf {

/// None where the message says that it holds no acceleration, or has no stamp. By sensor_msgs/Imu,
/// -1 in the first place of a covariance says that the sensor does not measure that.
inline std::optional<InertialSample> sampleOf(const sensor_msgs::Imu& imu) {
  if (imu.linear_acceleration_covariance[0] == -1.0 || imu.header.stamp.isZero()) {
    return std::nullopt;
  }
  const auto toVector = [](const geometry_msgs::Vector3& v) {
    return Eigen::Vector3d(v.x, v.y, v.z);
  };
  InertialSample sample{imu.header.stamp.toSec(), toVector(imu.linear_acceleration), {}};
  if (imu.angular_velocity_covariance[0] != -1.0)
    sample.turn_rad_s = toVector(imu.angular_velocity);
  return sample;
}

}  // namespace dtsdf
