/// Camera motion in the bags written by make_room_bag.
#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>

#include "simulation/scene.h"

namespace dtsdf {

/// Pose of the camera relative to its base.
inline Eigen::Isometry3d mount() {
  Eigen::Isometry3d T_B_C(Eigen::Translation3d(0.2, 0.0, 0.5));
  T_B_C.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return T_B_C;
}

namespace room_bag {

constexpr double kPeriod_s = 0.05;

inline ros::Time stampOf(int frame) { return ros::Time(1000.0) + ros::Duration(kPeriod_s * frame); }

/// Pose of the camera in the room's frame R.
inline Eigen::Isometry3d poseAt(int frame) { return roomCameraPose(kPeriod_s * frame); }

/// Number of images in the bag `drifting`, in which the odometry drifts by up to 9 cm and 3
/// degrees.
constexpr int kDriftingFrames = 60;

/// Pose of the frame odom in R, with the drift up to this image.
inline Eigen::Isometry3d driftAt(int frame) {
  const double share = static_cast<double>(frame) / kDriftingFrames;
  Eigen::Isometry3d T_R_O(Eigen::Translation3d(0.08 * share, -0.04 * share, 0.01 * share));
  T_R_O.rotate(Eigen::AngleAxisd(0.05 * share, Eigen::Vector3d::UnitZ()));
  return T_R_O;
}

/// Numbers of images in the bag `covered`, which contains no transforms. The camera is moved, then
/// covered for two seconds, then held still near its last position.
constexpr int kCarried = 30, kCovered = 40, kHeld = 10;

inline bool isCovered(int frame) { return frame >= kCarried && frame < kCarried + kCovered; }

inline Eigen::Isometry3d heldPose() {
  Eigen::Isometry3d T_R_C = poseAt(kCarried - 1);
  T_R_C.translate(Eigen::Vector3d(0.036, -0.018, 0.012));
  T_R_C.rotate(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()));
  return T_R_C;
}

}  // namespace room_bag
}  // namespace dtsdf
