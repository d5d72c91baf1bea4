/// A camera 1 m in front of a wall. Tests may modify its messages before sending them.
#pragma once

#include <ros/node_handle.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_ros/transform_broadcaster.h>

#include <Eigen/Geometry>
#include <string>

#include "dtsdf_mapping/pinhole.h"
#include "ros/support/camera_topics.h"

namespace dtsdf {

class FakeCamera {
 public:
  static constexpr int kWidth = 64;
  static constexpr int kHeight = 48;
  static constexpr Intrinsics kIntrinsics{60.0f, 60.0f, 31.5f, 23.5f};

  explicit FakeCamera(ros::NodeHandle nh);

  /// Waits until the mapper has subscribed.
  bool connect() const;

  /// The current time, but at least 10 ms after the previous stamp.
  ros::Time nextStamp();

  sensor_msgs::Image image(const ros::Time& stamp) const;
  sensor_msgs::CameraInfo info(const ros::Time& stamp) const;

  void send(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info) const {
    images_.send(image, info);
  }
  void sendTransform(const ros::Time& stamp, const Eigen::Vector3d& t_W = {0.0, 0.0, 0.0},
                     const std::string& frame = "camera");
  void sendPose(const Eigen::Isometry3d& T_W_F, const ros::Time& stamp,
                const std::string& frame = "camera");

  /// Sends a valid frame with its transform. Returns the frame's stamp.
  ros::Time sendFrame();

 private:
  CameraTopics images_;
  ros::Publisher transforms_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Time last_stamp_;
};

}  // namespace dtsdf
