/// A simulated depth camera in a simulated room, and a subscriber to the poses published by the
/// node.
#pragma once

#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <Eigen/Geometry>
#include <optional>

#include "ros/support/camera_topics.h"
#include "ros/support/room_bags.h"
#include "simulation/scene.h"
#include "support/pose_distance.h"

namespace dtsdf {

class RoomCamera {
 public:
  /// Images have the frame_id "camera".
  explicit RoomCamera(ros::NodeHandle nh);

  /// Waits until this many mappers have subscribed.
  bool connect(uint32_t mappers = 1) const;

  /// Sends a rendered image of the room. T_R_C is the pose of the camera in the room.
  void see(const Eigen::Isometry3d& T_R_C, const ros::Time& stamp);

  void sendTransform(const std::string& parent, const std::string& child,
                     const Eigen::Isometry3d& T, const ros::Time& stamp);

 private:
  Scene room_;
  CameraTopics images_;
  ros::Publisher transforms_;
};

class OdometryWatcher {
 public:
  explicit OdometryWatcher(ros::NodeHandle nh);

  /// Whether an odometry publisher is connected.
  bool isConnected() const { return odometry_topic_.getNumPublishers() > 0; }

  const nav_msgs::Odometry& odometry() const { return odometry_; }
  size_t count() const { return count_; }
  const nav_msgs::Path& path() const { return path_; }

  /// Waits for the odometry with this stamp.
  bool waitFor(const ros::Time& stamp) const;

  /// The pose in the newest odometry.
  Eigen::Isometry3d pose() const;

  /// Returns the transform from TF at a stamp, or nothing if it does not arrive within 10 s.
  std::optional<Eigen::Isometry3d> transform(const std::string& parent, const std::string& child,
                                             const ros::Time& stamp) const;

 private:
  nav_msgs::Odometry odometry_;
  nav_msgs::Path path_;
  size_t count_ = 0;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_{buffer_};
  ros::Subscriber odometry_topic_, path_topic_;
};

}  // namespace dtsdf
