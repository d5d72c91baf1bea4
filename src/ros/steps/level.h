/// The step that levels the map, and sets the centre of map/keep_radius_m for depth images.
#pragma once

#include <ros/console.h>
#include <ros/node_handle.h>
#include <sensor_msgs/Imu.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <cmath>
#include <optional>
#include <string>
#include <variant>

#include "level/floor.h"
#include "level/level_pose.h"
#include "level/still_gravity.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/input/conversions.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Levels the map as set by map/level. Frames are dropped until the floor or gravity is known. The
/// levelling transform, published on /tf_static, then stays fixed until a levelled map is loaded.
/// Used on the map thread only, so that an IMU message cannot overwrite the transform of a map that
/// has just been loaded.
class LevelStep : public Step {
 public:
  LevelStep(const NodeParams& params, const Transforms& transforms, MapFrame& frame)
      : params_(params),
        transforms_(transforms),
        frame_(frame),
        problem_(isByImu() ? "no IMU message received; remap the topic imu, or set map/level to "
                             "floor or none"
                           : "looking for the floor in " + std::to_string(FloorSearch::kViews) +
                                 " images") {}

  /// If map/level is imu, subscribes to the IMU until the vertical is known.
  void advertise(const Handles& handles) override {
    if (!isByImu()) return;
    constexpr uint32_t kImuQueue = 1000;  // a second of data from a fast sensor
    const boost::function<void(const sensor_msgs::Imu::ConstPtr&)> callback =
        [this](const sensor_msgs::Imu::ConstPtr& imu) {
          guarded("imu", [&] { add(*imu); });
          if (isKnown()) imu_.shutdown();
        };
    ros::NodeHandle nh = handles.map;
    imu_ = nh.subscribe<sensor_msgs::Imu>(handles.ns + "/imu", kImuQueue, callback);
  }

  std::optional<Rejection> place(PosedFrame& frame) override {
    if (auto rejection = moveToLevelFrame(frame)) return rejection;
    frame.given_T_W_C = frame.T_W_C();
    auto* const depth = std::get_if<DepthFrame>(&frame.image);
    if (depth != nullptr) depth->keep_center_W = frame_.keepCenterAt(frame.stamp);
    return std::nullopt;
  }

  void replaced(const MapContents* loaded, const std::shared_ptr<const MapChunks>&) override {
    if (loaded != nullptr && loaded->T_W_M && frame_.isLevelled()) set(*loaded->T_W_M);
  }

  void add(const sensor_msgs::Imu& imu) {
    if (isKnown()) return;
    const std::optional<InertialSample> sample = sampleOf(imu);
    if (!sample || imu.header.frame_id.size() > kLongestName) {
      problem_ = "messages on imu have no stamp, no acceleration or too long a frame_id";
      return;
    }
    if (const auto up_I = gravity_.add(*sample); up_I && !up_I_) {
      up_I_ = up_I;
      measured_ = imu.header;
    }
    if (!up_I_) {
      problem_ = "the IMU has not been at rest (9.8 m/s^2) for a second; hold it still";
      return;
    }
    const PoseAnswer answer = transforms_.find(
        frameOfPoses(params_), stripLeadingSlash(measured_.frame_id), measured_.stamp);
    if (answer.T_W_C) return set(levelPose(answer.T_W_C->linear() * *up_I_));
    problem_ = "IMU: " + answer.text;
    // Gives up on this measurement after a while, or if stamps went back: the next measurement may
    // have a transform.
    constexpr double kMaxWait_s = 10.0;
    const double waited_s = std::abs(imu.header.stamp.toSec() - measured_.stamp.toSec());
    if (!answer.may_come || waited_s > kMaxWait_s) up_I_.reset();
  }

  /// Why the vertical is not known yet.
  const std::string& problem() const { return problem_; }

 private:
  bool isByImu() const { return params_.level == LevelChoice::kImu; }
  bool isKnown() const { return !frame_.isLevelled() || frame_.level().has_value(); }

  /// Transforms a frame's pose to the levelled frame.
  std::optional<Rejection> moveToLevelFrame(PosedFrame& frame) {
    const auto* const depth = std::get_if<DepthFrame>(&frame.image);
    if (!frame_.isLevelled()) return std::nullopt;
    // The frame in which the floor is found is dropped, too.
    const bool searches = !isKnown() && depth != nullptr;
    if (searches && !isByImu()) findFloor(*depth);
    const std::optional<Eigen::Isometry3d> T_W_M = frame_.level();
    if (searches || !T_W_M) {
      return Rejection{drop::kNotLevel, "the map is not levelled yet: " + problem_};
    }
    frame.move(*T_W_M);
    return std::nullopt;
  }

  void findFloor(const DepthFrame& frame) {
    if (!floor_.add(frame)) return;
    if (floor_.floor()) return set(levelPose(*floor_.floor()));
    problem_ = floor_.problem() +
               "; hold the camera upright, within 45 degrees, and point it at the floor, or set "
               "map/level to imu or none";
  }

  void set(const Eigen::Isometry3d& T_W_M) {
    frame_.setLevel(T_W_M);
    ROS_INFO_STREAM_NAMED("dtsdf_mapping", "levelled: " << describeLevel(T_W_M));
    if (!ros::isInitialized()) return;  // as in tests without ROS
    if (!broadcaster_) broadcaster_.emplace();
    broadcaster_->sendTransform(
        makeTransform(params_.map_frame, frameOfMap(params_), T_W_M.inverse(), ros::Time::now()));
  }

  const NodeParams& params_;
  const Transforms& transforms_;
  MapFrame& frame_;
  std::string problem_;  ///< Why the vertical is not known, and what to do.
  FloorSearch floor_;
  StillGravity gravity_;
  std::optional<Eigen::Vector3d> up_I_;  ///< Up in the sensor's frame, until its transform arrives.
  std_msgs::Header measured_;            ///< Frame and stamp of up_I_.
  ros::Subscriber imu_;

  std::optional<tf2_ros::StaticTransformBroadcaster> broadcaster_;
};

}  // namespace dtsdf
