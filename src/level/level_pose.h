/// The frame W that is level, from what is known of up and of the floor in another frame M.
#pragma once

#include <Eigen/Geometry>
#include <string>

namespace dtsdf {

/// T_W_M: z of W is up, and z = 0 are the points p with up . p = `floor_offset_m`. The turn is the
/// smallest that does so, so that a frame that is almost level keeps its x and y; the origin of W
/// lies above or below that of M.
Eigen::Isometry3d levelPose(const Eigen::Vector3d& up_M, double floor_offset_m = 0.0);

/// How far z of M is from up, in degrees.
double tiltOf(const Eigen::Isometry3d& T_W_M);

/// Where M lies in W, in words for who runs a program.
std::string describeLevel(const Eigen::Isometry3d& T_W_M);

}  // namespace dtsdf
