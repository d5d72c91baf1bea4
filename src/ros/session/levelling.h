/// The frame that the map is in: map_frame itself, or one that is level, once up is known; and
/// where other frames are in it.
#pragma once

#include <ros/node_handle.h>
#include <ros/time.h>
#include <sensor_msgs/Imu.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "level/floor.h"
#include "level/level_pose.h"
#include "level/still_gravity.h"
#include "params/node_params.h"
#include "ros/input/frame_queue.h"
#include "ros/input/pose_source.h"

namespace dtsdf {

/// By map/level: `none` leaves all poses as they are. Else frames are dropped until the floor or
/// gravity is known; from then on the level is the same until the node ends or a map is loaded,
/// which brings its own. Thread safe where nothing else is said.
class Levelling {
 public:
  /// `announce` is called with each level that there is from now on, T_W_M, by whoever brings it.
  /// `poses` outlives it.
  Levelling(const MappingParams& params, const PoseSource& poses,
            std::function<void(const Eigen::Isometry3d&)> announce);

  /// Whether the map has a frame of its own.
  bool isOn() const { return from_ != LevelChoice::kNone; }

  /// Map's thread: brings the pose of a frame from M to W, after a look at it where that is needed.
  /// False while up is not known: the frame is not to be fused.
  bool bring(PosedFrame& frame);

  /// One thread: a message of an inertial sensor.
  void add(const sensor_msgs::Imu& imu);

  /// That of a map that was loaded.
  void set(const Eigen::Isometry3d& T_W_M);

  /// What is to be saved with the map; none where it is in map_frame, or nothing is known yet.
  std::optional<Eigen::Isometry3d> level() const;

  /// Whether nothing is waited for any more.
  bool isKnown() const { return !isOn() || level().has_value(); }

  /// What is in M, in W. @throws std::runtime_error while up is not known.
  Eigen::Isometry3d inMap(const Eigen::Isometry3d& T_M_F) const;

  /// Why up is not known, and what to do.
  std::string problem() const;

 private:
  /// Up in the frame of the sensor, which waits for its transform.
  struct MeasuredUp {
    Eigen::Vector3d up_I;
    std::string frame;
    ros::Time stamp;
  };

  void lookForFloor(const DepthFrame& frame);
  void lookUpTransform();
  void noteProblem(const std::string& text);

  const LevelChoice from_;
  const PoseSource& poses_;
  const std::function<void(const Eigen::Isometry3d&)> announce_;
  FloorSearch floor_;                   ///< Map's thread only.
  std::optional<LevelDoubt> doubt_;     ///< The same; where space is kept without a level.
  StillGravity gravity_;                ///< The sensor's thread only.
  std::optional<MeasuredUp> measured_;  ///< The same.

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::optional<Eigen::Isometry3d> T_W_M_;
  std::string problem_;
};

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

/// Where frames are in the map, for services and for map/keep_radius_m. Thread safe.
class MapPoses {
 public:
  /// All of it outlives it.
  MapPoses(const MappingParams& params, const PoseSource& poses, const Levelling& levelling)
      : params_(params), poses_(poses), levelling_(levelling) {}

  /// Of a frame, at a time; 0: by the newest transform. An empty name is the frame of the map. A
  /// transform of just now may be on its way; as long as that of an image is waited for.
  /// @throws std::runtime_error where there is none.
  Eigen::Isometry3d find(const std::string& frame_id, const ros::Time& stamp = ros::Time(0)) const;

  /// Where map/keep_frame is at the stamp, or else now; none where it is not known, or not set.
  std::optional<Eigen::Vector3d> keepCenterAt(const ros::Time& stamp) const;

 private:
  PoseAnswer waitFor(const std::string& frame, const ros::Time& stamp) const;
  /// Of the frames that need no transform.
  std::optional<Eigen::Isometry3d> poseOfFixed(const std::string& frame) const;

  const MappingParams& params_;
  const PoseSource& poses_;
  const Levelling& levelling_;
};

}  // namespace dtsdf
