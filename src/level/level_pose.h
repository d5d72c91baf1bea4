/// Computes a level frame W from the vertical and the floor in another frame M.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "level/floor.h"

namespace dtsdf {

/// The pose T_W_M for which z of W points up, and points p with up . p = `floor_offset_m` have z =
/// 0. The rotation is the smallest possible, so an almost level frame keeps its x and y. The origin
/// of W is straight above or below that of M.
Eigen::Isometry3d levelPose(const Eigen::Vector3d& up_M, double floor_offset_m = 0.0);

/// The pose T_W_M for which up is the normal of a floor, and the floor is at z = 0.
inline Eigen::Isometry3d levelPose(const FloorPlane& floor) {
  return levelPose(floor.normal(), -floor.offset());
}

/// Angle between z of M and up, in degrees.
double tiltOf(const Eigen::Isometry3d& T_W_M);

std::string describeLevel(const Eigen::Isometry3d& T_W_M);

}  // namespace dtsdf
