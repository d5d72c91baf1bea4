/// What levelling has to do with other nodes: the topic of an inertial sensor, and the transform.
#pragma once

#include <ros/node_handle.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <memory>
#include <string>

#include "ros/session/levelling.h"

namespace dtsdf {

/// Publishes where the level frame lies in map_frame. Nothing is advertised before the first one.
class LevelTransform {
 public:
  LevelTransform(std::string map_frame, std::string level_frame);

  /// One thread at a time.
  void publish(const Eigen::Isometry3d& T_W_M);

 private:
  const std::string map_frame_, level_frame_;
  std::unique_ptr<tf2_ros::StaticTransformBroadcaster> broadcaster_;
};

/// Subscribes the sensor, where map/level asks for it, until up is known.
class ImuInput {
 public:
  /// `ns` is the namespace of the topic (see CameraInput for why); `levelling` outlives it.
  ImuInput(ros::NodeHandle nh, const std::string& ns, const NodeParams& params,
           Levelling& levelling);

 private:
  void onMessage(const sensor_msgs::Imu::ConstPtr& imu);

  Levelling& levelling_;
  ros::Subscriber subscriber_;
};

}  // namespace dtsdf
