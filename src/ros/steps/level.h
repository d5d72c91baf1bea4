/// The step that makes the map's frame: its level, and the centre of what is kept of the map.
#pragma once

#include <ros/node_handle.h>
#include <sensor_msgs/Imu.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "level/floor.h"
#include "level/level_pose.h"
#include "level/still_gravity.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// By map/level: `none` leaves all poses as they are. Else frames are dropped until the floor or
/// gravity is known; from then on the level is the same until the node ends or a map is loaded,
/// which brings its own. It is published on /tf_static.
class LevelStep : public Step {
 public:
  LevelStep(const MappingParams& params, const Transforms& transforms, MapFrame& frame);

  /// Subscribes the sensor, where map/level asks for it, until up is known.
  void advertise(const Handles& handles) override;
  std::optional<Rejection> place(PosedFrame& frame) override;
  void replaced(const Replacement& replacement) override;

  /// Input's thread: a message of the inertial sensor.
  void add(const sensor_msgs::Imu& imu);

 private:
  /// Up in the frame of the sensor, which waits for its transform.
  struct MeasuredUp {
    Eigen::Vector3d up_I;
    std::string frame;
    ros::Time stamp;
  };

  std::optional<Rejection> raise(PosedFrame& frame);
  bool isKnown() const { return !frame_.isLevelled() || frame_.level().has_value(); }
  void lookForFloor(const DepthFrame& frame);
  void lookUpTransform();
  void set(const Eigen::Isometry3d& T_W_M);

  const MappingParams& params_;
  const Transforms& transforms_;
  MapFrame& frame_;
  FloorSearch floor_;                   ///< Map's thread only.
  std::optional<LevelDoubt> doubt_;     ///< The same; where space is kept without a level.
  StillGravity gravity_;                ///< Input's thread only.
  std::optional<MeasuredUp> measured_;  ///< The same.
  ros::Subscriber imu_;
  std::unique_ptr<tf2_ros::StaticTransformBroadcaster> broadcaster_;
};

}  // namespace dtsdf
