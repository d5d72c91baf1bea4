/// Publishes poses that were found: as odometry, as a path, and in TF.
#pragma once

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <tf2_ros/transform_broadcaster.h>

#include <mutex>
#include <string>

#include "params/node_params.h"
#include "ros/common/steady_clock.h"
#include "ros/input/transform_buffer.h"
#include "ros/output/found_pose.h"

namespace dtsdf {

/// Map's thread only, but for problem(). No frame gets a second parent: where a transform of others
/// has another one, it is not published.
class PosePublisher {
 public:
  /// Topics of `private_nh`; `transforms` outlives it.
  PosePublisher(ros::NodeHandle private_nh, const NodeParams& params,
                const TransformBuffer& transforms);

  /// With track also in TF.
  void publish(const FoundPose& pose);

  /// With refine and poses/odom_frame: where that lies in map_frame.
  void publishCorrection(const ros::Time& stamp, const Eigen::Isometry3d& T_M_O);

  /// The path begins anew, as the map does.
  void clearPath();

  /// Why a transform is not published; empty: all are.
  std::string problem() const;

 private:
  void publishOdometry(const FoundPose& pose);
  void addToPath(const FoundPose& pose);
  void sendTransform(const std::string& parent, const std::string& child,
                     const Eigen::Isometry3d& T, const ros::Time& stamp);

  const bool tracks_;
  const std::string map_frame_;   ///< Of M.
  const std::string path_frame_;  ///< Of W.
  const std::string parent_;      ///< Of what poses are published of.
  std::string odom_frame_;        ///< Whose correction is published; empty: none is.
  const TransformBuffer& transforms_;
  ros::Publisher odometry_, path_topic_;
  tf2_ros::TransformBroadcaster broadcaster_;
  nav_msgs::Path path_;
  Eigen::Isometry3d last_on_path_T_W_B_ = Eigen::Isometry3d::Identity();
  SteadyTime path_sent_{};

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::string problem_;
};

}  // namespace dtsdf
