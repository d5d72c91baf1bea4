#include "ros/session/levelling.h"

#include <ros/console.h>

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>
#include <variant>

#include "level/level_pose.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/common/schedule.h"
#include "ros/input/conversions.h"

namespace dtsdf {
namespace {

constexpr char kFloorAdvice[] =
    "hold the camera upright, within 45 degrees, and let it see the floor, or set map/level to "
    "imu or none";
/// A transform that is not there by then will not come.
constexpr double kMaxWait_s = 10.0;

}  // namespace

Levelling::Levelling(const MappingParams& params, const PoseSource& poses,
                     std::function<void(const Eigen::Isometry3d&)> announce)
    : from_(params.node.level.from), poses_(poses), announce_(std::move(announce)) {
  if (from_ == LevelChoice::kNone && params.mapper.space.enabled) doubt_.emplace();
  if (from_ == LevelChoice::kFloor) {
    problem_ = "looking for the floor in " + std::to_string(FloorSearch::kViews) + " images";
  } else if (from_ == LevelChoice::kImu) {
    problem_ =
        "no message of the inertial sensor received; remap the topic imu, or set map/level to "
        "floor or none";
  }
}

bool Levelling::bring(PosedFrame& frame) {
  const auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (!isOn()) {
    if (doubt_ && depth != nullptr && doubt_->add(*depth) && !doubt_->text().empty()) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", doubt_->text());
    }
    return true;
  }
  // What the floor is found by is dropped: what follows is fused in the frame that is known then.
  if (!isKnown() && depth != nullptr && from_ == LevelChoice::kFloor) {
    lookForFloor(*depth);
    return false;
  }
  const std::optional<Eigen::Isometry3d> T_W_M = level();
  if (!T_W_M) return false;
  std::visit([&](auto& image) { image.T_W_C = *T_W_M * image.T_W_C; }, frame.image);
  return true;
}

void Levelling::lookForFloor(const DepthFrame& frame) {
  if (!floor_.add(frame)) return;
  if (floor_.floor()) return set(levelPose(floor_.floor()->normal, floor_.floor()->offset_m));
  noteProblem(floor_.problem() + "; " + kFloorAdvice);
}

void Levelling::add(const sensor_msgs::Imu& imu) {
  if (from_ != LevelChoice::kImu || isKnown()) return;
  const std::optional<InertialSample> sample = sampleOf(imu);
  if (!sample) return noteProblem("messages on imu have no stamp or no acceleration");
  if (const auto up_I = gravity_.add(*sample); up_I && !measured_) {
    measured_ = MeasuredUp{*up_I, stripLeadingSlash(imu.header.frame_id), imu.header.stamp};
  }
  if (!measured_) {
    return noteProblem(
        "the inertial sensor has not been still, at 9.8 m/s^2, for a second; hold it still");
  }
  lookUpTransform();
  if (!measured_) return;
  // Also where stamps have gone back; the next still second may have a transform.
  const double waited_s = std::abs(imu.header.stamp.toSec() - measured_->stamp.toSec());
  if (waited_s > kMaxWait_s) measured_.reset();
}

void Levelling::lookUpTransform() {
  const PoseAnswer answer = poses_.find(measured_->frame, measured_->stamp);
  if (answer.kind == PoseAnswer::Kind::kKnown)
    return set(levelPose(answer.T_W_C.linear() * measured_->up_I));
  noteProblem("inertial sensor: " + answer.text);
  if (answer.kind == PoseAnswer::Kind::kNever) measured_.reset();
}

void Levelling::set(const Eigen::Isometry3d& T_W_M) {
  const std::lock_guard<std::mutex> lock(mutex_);
  T_W_M_ = T_W_M;
  problem_.clear();
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "levelled: " << describeLevel(T_W_M));
  announce_(T_W_M);
}

std::optional<Eigen::Isometry3d> Levelling::level() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return T_W_M_;
}

Eigen::Isometry3d Levelling::inMap(const Eigen::Isometry3d& T_M_F) const {
  if (!isOn()) return T_M_F;
  const std::optional<Eigen::Isometry3d> T_W_M = level();
  if (!T_W_M) throw std::runtime_error("the map is not level yet: " + problem());
  return *T_W_M * T_M_F;
}

void Levelling::noteProblem(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  problem_ = text;
}

std::string Levelling::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

namespace {

/// A second of a fast sensor.
constexpr uint32_t kImuQueue = 1000;

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
  subscriber_ = nh.subscribe(ns + "/imu", kImuQueue, &ImuInput::onMessage, this);
}

void ImuInput::onMessage(const sensor_msgs::Imu::ConstPtr& imu) {
  guarded("the inertial sensor", [&] { levelling_.add(*imu); });
  if (levelling_.isKnown()) subscriber_.shutdown();
}

Eigen::Isometry3d MapPoses::find(const std::string& frame_id, const ros::Time& stamp) const {
  const std::string frame = stripLeadingSlash(frame_id);
  if (frame.empty()) return Eigen::Isometry3d::Identity();
  if (const auto fixed = poseOfFixed(frame)) return *fixed;
  const PoseAnswer answer = waitFor(frame, stamp);
  if (answer.kind != PoseAnswer::Kind::kKnown) throw std::runtime_error(answer.text);
  return levelling_.inMap(answer.T_W_C);
}

std::optional<Eigen::Isometry3d> MapPoses::poseOfFixed(const std::string& frame) const {
  if (frame == frameOfMap(params_.node)) return Eigen::Isometry3d::Identity();
  if (frame == poses_.mapFrame()) return levelling_.inMap(Eigen::Isometry3d::Identity());
  return std::nullopt;
}

PoseAnswer MapPoses::waitFor(const std::string& frame, const ros::Time& stamp) const {
  const auto end =
      std::chrono::steady_clock::now() + toSteadyDuration(params_.node.input.tf_timeout_s);
  for (;;) {
    PoseAnswer answer = poses_.find(frame, stamp);
    if (answer.kind != PoseAnswer::Kind::kNotYet || stamp.isZero()) return answer;
    if (std::chrono::steady_clock::now() >= end) return answer;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::optional<Eigen::Vector3d> MapPoses::keepCenterAt(const ros::Time& stamp) const {
  const std::string& frame = params_.node.keep_frame;
  if (frame.empty() || params_.mapper.map.keep_radius_m == 0.0f) return std::nullopt;
  if (const auto fixed = poseOfFixed(frame)) return fixed->translation();
  for (const ros::Time& time : {stamp, ros::Time(0)}) {
    const PoseAnswer answer = poses_.lookUp(frame, time);
    if (answer.kind == PoseAnswer::Kind::kKnown) {
      return levelling_.inMap(answer.T_W_C).translation();
    }
    if (!time.isZero()) continue;
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "map/keep_radius_m is centred on the camera, because "
                                   "map/keep_frame is not known: "
                                       << answer.text);
  }
  return std::nullopt;
}

}  // namespace dtsdf
