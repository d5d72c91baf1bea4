/// A pose that was found, as it is published, and how well it is known.
#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Of a depth image that was fused. B is poses/base_frame, or else the frame of its camera.
struct FoundPose {
  ros::Time stamp;
  std::string frame_id;                                     ///< Name of B.
  Eigen::Isometry3d T_M_B = Eigen::Isometry3d::Identity();  ///< In map_frame.
  Eigen::Isometry3d T_W_B = Eigen::Isometry3d::Identity();  ///< In the frame of the map.
  Matrix6d covariance = Matrix6d::Zero();                   ///< Of T_M_B, as odometry has it.
};

/// Axes along (or about) which an image does not hold its pose: there the error is still more than
/// half of what it was before. `covariance` is the position's or the rotation's, `sigma` the
/// prior's.
std::vector<Eigen::Vector3d> freeAxes(const Eigen::Matrix3d& covariance, double sigma);

/// Of a pose in the map. In track, an error along a free axis adds up from image to image, so that
/// nothing is known of it after a while: its variance is made large.
Matrix6d odometryCovariance(const Alignment& alignment, const PoseParams& params);

/// Of the pose of B in M, from that of C in W, where B is fixed to C: turned by R_M_W, and about B,
/// which is offset_M from C.
Matrix6d movedCovariance(const Matrix6d& covariance, const Eigen::Matrix3d& R_M_W,
                         const Eigen::Vector3d& offset_M);

}  // namespace dtsdf
