#include "ros/steps/level.h"

#include <ros/console.h>

#include <cmath>
#include <variant>

#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/input/conversions.h"

namespace dtsdf {
namespace {

constexpr char kFloorAdvice[] =
    "hold the camera upright, within 45 degrees, and let it see the floor, or set map/level to "
    "imu or none";
/// A transform that has not come by then will not come.
constexpr double kMaxWait_s = 10.0;
/// A second of a fast sensor.
constexpr uint32_t kImuQueue = 1000;

}  // namespace

LevelStep::LevelStep(const MappingParams& params, const Transforms& transforms, MapFrame& frame)
    : params_(params), transforms_(transforms), frame_(frame) {
  const LevelChoice from = params.node.level.from;
  if (from == LevelChoice::kNone && params.mapper.space.enabled) doubt_.emplace();
  if (from == LevelChoice::kFloor) {
    frame_.setLevelProblem("looking for the floor in " + std::to_string(FloorSearch::kViews) +
                           " images");
  } else if (from == LevelChoice::kImu) {
    frame_.setLevelProblem(
        "no message of the inertial sensor received; remap the topic imu, or set map/level to "
        "floor or none");
  }
}

void LevelStep::advertise(const Handles& handles) {
  if (params_.node.level.from != LevelChoice::kImu) return;
  const std::string& ns = handles.prompt.getNamespace();
  const boost::function<void(const sensor_msgs::Imu::ConstPtr&)> callback =
      [this](const sensor_msgs::Imu::ConstPtr& imu) {
        guarded("the inertial sensor", [&] { add(*imu); });
        if (isKnown()) imu_.shutdown();
      };
  ros::NodeHandle nh = handles.input;
  imu_ = nh.subscribe<sensor_msgs::Imu>(ns.substr(0, ns.rfind('/')) + "/imu", kImuQueue, callback);
}

std::optional<Rejection> LevelStep::place(PosedFrame& frame) {
  if (auto rejection = raise(frame)) return rejection;
  std::visit([&](const auto& image) { frame.given_T_W_C = image.T_W_C; }, frame.image);
  auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth != nullptr) depth->keep_center_W = frame_.keepCenterAt(frame.stamp);
  return std::nullopt;
}

/// Brings it into the level frame.
std::optional<Rejection> LevelStep::raise(PosedFrame& frame) {
  const auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (!frame_.isLevelled()) {
    if (doubt_ && depth != nullptr && doubt_->add(*depth) && !doubt_->text().empty()) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", doubt_->text());
    }
    return std::nullopt;
  }
  // What the floor is found by is dropped: what follows is fused in the frame that is known then.
  const bool looks = !isKnown() && depth != nullptr;
  if (looks && params_.node.level.from == LevelChoice::kFloor) lookForFloor(*depth);
  const std::optional<Eigen::Isometry3d> T_W_M = frame_.level();
  if (looks || !T_W_M) {
    return Rejection{DropReason::kNotLevel, "the map is not level yet: " + frame_.levelProblem()};
  }
  std::visit([&](auto& image) { image.T_W_C = *T_W_M * image.T_W_C; }, frame.image);
  return std::nullopt;
}

void LevelStep::lookForFloor(const DepthFrame& frame) {
  if (!floor_.add(frame)) return;
  if (floor_.floor()) return set(levelPose(floor_.floor()->normal, floor_.floor()->offset_m));
  frame_.setLevelProblem(floor_.problem() + "; " + kFloorAdvice);
}

void LevelStep::add(const sensor_msgs::Imu& imu) {
  if (isKnown()) return;
  const std::optional<InertialSample> sample = sampleOf(imu);
  if (!sample || imu.header.frame_id.size() > kLongestName) {
    return frame_.setLevelProblem("messages on imu have no stamp, no frame or no acceleration");
  }
  if (const auto up_I = gravity_.add(*sample); up_I && !measured_) {
    measured_ = MeasuredUp{*up_I, stripLeadingSlash(imu.header.frame_id), imu.header.stamp};
  }
  if (!measured_) {
    return frame_.setLevelProblem(
        "the inertial sensor has not been still, at 9.8 m/s^2, for a second; hold it still");
  }
  lookUpTransform();
  if (!measured_) return;
  // Also where stamps have gone back; the next still second may have a transform.
  const double waited_s = std::abs(imu.header.stamp.toSec() - measured_->stamp.toSec());
  if (waited_s > kMaxWait_s) measured_.reset();
}

void LevelStep::lookUpTransform() {
  const PoseAnswer answer =
      transforms_.find(frameOfPoses(params_.node), measured_->frame, measured_->stamp);
  if (answer.T_W_C) return set(levelPose(answer.T_W_C->linear() * measured_->up_I));
  frame_.setLevelProblem("inertial sensor: " + answer.text);
  if (!answer.may_come) measured_.reset();
}

void LevelStep::set(const Eigen::Isometry3d& T_W_M) {
  frame_.setLevel(T_W_M);
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "levelled: " << describeLevel(T_W_M));
  if (!ros::isInitialized()) return;  // as in tests without ROS
  if (broadcaster_ == nullptr) {
    broadcaster_ = std::make_unique<tf2_ros::StaticTransformBroadcaster>();
  }
  broadcaster_->sendTransform(makeTransform(params_.node.map_frame, frameOfMap(params_.node),
                                            T_W_M.inverse(), ros::Time::now()));
}

void LevelStep::replaced(const Replacement& replacement) {
  if (replacement.kind != Replacement::Kind::kLoaded || !frame_.isLevelled()) return;
  if (replacement.head->T_W_M) set(*replacement.head->T_W_M);
}

}  // namespace dtsdf
