#include "ros/session/levelling.h"

#include <ros/console.h>

#include <cmath>
#include <stdexcept>
#include <utility>
#include <variant>

#include "level/level_pose.h"
#include "params/frame_name.h"
#include "params/printable.h"
#include "ros/input/inertial_message.h"

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

}  // namespace dtsdf
