/// Computes the levelling transform T_W_M from the vertical, and optionally the floor, in a frame
/// M.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "level/floor.h"

namespace dtsdf {

/// The transform T_W_M such that z of W points up, and points p with up . p = `floor_offset_m` have
/// z = 0. The rotation is the smallest possible, so x and y of an almost level frame hardly change.
/// The origin of W is straight above or below that of M.
Eigen::Isometry3d levelPose(const Eigen::Vector3d& up_M, double floor_offset_m = 0.0);

/// The transform T_W_M such that the normal of the floor points up, and the floor is at z = 0.
inline Eigen::Isometry3d levelPose(const FloorPlane& floor) {
  return levelPose(floor.normal(), -floor.offset());
}

/// Angle between z of M and the vertical, in degrees.
double tiltOf(const Eigen::Isometry3d& T_W_M);

std::string describeLevel(const Eigen::Isometry3d& T_W_M);

}  // namespace dtsdf
