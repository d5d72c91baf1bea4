/// Publishes poses that were found, and how well they are known: as odometry, as a path, and in TF.
#pragma once

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <tf2_ros/transform_broadcaster.h>

#include <Eigen/Geometry>
#include <mutex>
#include <string>
#include <vector>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/params/pose_params.h"
#include "params/node_params.h"
#include "ros/common/pace.h"
#include "ros/input/transforms.h"

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

/// Map's thread only, but for problem(). No frame gets a second parent: where a transform of others
/// has another one, it is not published.
class PosePublisher {
 public:
  /// Topics of `private_nh`; the others outlive it.
  PosePublisher(ros::NodeHandle private_nh, const NodeParams& params, const Transforms& transforms);

  /// With track also in TF.
  void publish(const FoundPose& pose);

  /// With refine and poses/odom_frame: where that lies in map_frame.
  void publishCorrection(const ros::Time& stamp, const Eigen::Isometry3d& T_M_O);

  /// The path starts over, as the map does.
  void clearPath();

  /// Why a transform is not published; empty: all are.
  std::string problem() const;

 private:
  void publishOdometry(const FoundPose& pose);
  void addToPath(const FoundPose& pose);
  void sendTransform(const std::string& parent, const std::string& child,
                     const Eigen::Isometry3d& T, const ros::Time& stamp);

  bool tracks() const { return params_.poses.mode == PoseMode::kTrack; }

  const NodeParams& params_;
  const std::string parent_;  ///< Of what poses are published of.
  const Transforms& transforms_;
  ros::Publisher odometry_, path_topic_;
  tf2_ros::TransformBroadcaster broadcaster_;
  nav_msgs::Path path_;
  Eigen::Isometry3d last_on_path_T_W_B_ = Eigen::Isometry3d::Identity();
  SteadyTime path_sent_{};

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::string problem_;
};

}  // namespace dtsdf
