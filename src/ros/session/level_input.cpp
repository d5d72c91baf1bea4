#include "ros/session/level_input.h"

#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/input/transform_conversions.h"

namespace dtsdf {
namespace {

/// A second of a fast sensor.
constexpr uint32_t kQueue = 1000;

}  // namespace

LevelTransform::LevelTransform(std::string map_frame, std::string level_frame)
    : map_frame_(std::move(map_frame)), level_frame_(std::move(level_frame)) {}

void LevelTransform::publish(const Eigen::Isometry3d& T_W_M) {
  if (broadcaster_ == nullptr) {
    broadcaster_ = std::make_unique<tf2_ros::StaticTransformBroadcaster>();
  }
  broadcaster_->sendTransform(
      makeTransform(map_frame_, level_frame_, T_W_M.inverse(), ros::Time::now()));
}

ImuInput::ImuInput(ros::NodeHandle nh, const std::string& ns, const NodeParams& params,
                   Levelling& levelling)
    : levelling_(levelling) {
  if (params.level.from != LevelChoice::kImu) return;
  subscriber_ = nh.subscribe(ns + "/imu", kQueue, &ImuInput::onMessage, this);
}

void ImuInput::onMessage(const sensor_msgs::Imu::ConstPtr& imu) {
  guarded("the inertial sensor", [&] { levelling_.add(*imu); });
  if (levelling_.isKnown()) subscriber_.shutdown();
}

}  // namespace dtsdf
