/// Receives transforms, keeps them in a tf2 buffer, and looks up poses, with readable error texts.
#pragma once

#include <dtsdf_mapping/MapStatus.h>
#include <ros/console.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/common/pace.h"
#include "ros/input/conversions.h"

namespace dtsdf {

struct PoseAnswer {
  std::optional<Eigen::Isometry3d> T_W_C = std::nullopt;  ///< Nothing if unknown.
  bool may_come = false;  ///< The transform for the stamp may still arrive.
  std::string text = {};  ///< What is missing.
};

/// A tf2 buffer that recovers from wrong stamps: after a transform with a stamp far in the future,
/// tf2 refuses all correct transforms of the same frame. If no image pose is found for a while
/// although transforms arrive, all but the static transforms are discarded. Static transforms of
/// frames that are on /tf are ignored, in whatever order they come. Thread-safe.
class Transforms {
 public:
  /// Keeps transforms for `kept_s`; by default, for longer than frames normally wait.
  explicit Transforms(SteadyClock clock = std::chrono::steady_clock::now, double kept_s = 30.0)
      : clock_(std::move(clock)), kept_(kept_s) {}

  /// Receives /tf and /tf_static, on the queue of the node handle.
  void subscribe(ros::NodeHandle nh) {
    const auto subscribe = [&](const char* topic, bool is_static) {
      const boost::function<void(const Event&)> callback = [this, is_static](const Event& event) {
        guarded("transforms", [&] { onMessage(event, is_static); });
      };
      constexpr uint32_t kQueue = 100;  // as in tf2's own listener
      return nh.subscribe<tf2_msgs::TFMessage>(topic, kQueue, callback);
    };
    tf_ = subscribe("/tf", false);
    tf_static_ = subscribe("/tf_static", true);
  }

  void take(const geometry_msgs::TransformStamped& transform, const std::string& publisher,
            bool is_static = false) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::string child = stripLeadingSlash(transform.child_frame_id);
    if (is_static && moving_.count(child) > 0) {
      ++refused_;
      return;
    }
    const bool is_named = !child.empty() && !isLong(child) && !isLong(transform.header.frame_id);
    if (is_named && !is_static) {
      moving_.insert(child);
      received_at_ = clock_();
      if (statics_.erase(child) > 0) remake(child);
    }
    try {
      if (is_named && core_->setTransform(transform, publisher, is_static)) {
        if (is_static) statics_[child] = transform;
        return;
      }
    } catch (const std::exception&) {  // a stamp at the end of ROS time, or no memory
    }
    ++refused_;
  }

  /// The pose of `frame` in `parent` at a stamp; stamp 0 means the newest one.
  PoseAnswer find(const std::string& parent, const std::string& frame,
                  const ros::Time& stamp) const {
    PoseAnswer answer;
    if (isLong(frame) || isLong(parent)) {
      answer.text = formatted("the name of a frame is longer than %zu bytes", kLongestName);
      return answer;
    }
    // Determined before the look-up, since a transform that arrived in between would make the image
    // seem too old.
    const std::optional<ros::Time> newest = findNewest(parent, frame);
    try {
      answer.T_W_C = toIsometry(core()->lookupTransform(parent, frame, stamp).transform);
      return answer;
    } catch (const std::runtime_error& error) {
      // Thrown by tf2, or by ros::Duration if stamps are over 68 years apart.
      answer.text = "no transform from '" + printable(frame) + "' to '" + printable(parent) +
                    "': " + (newest ? errorText(error) : describeFrames());
    }
    answer.may_come = !newest || *newest < stamp;
    return answer;
  }

  /// Records whether the pose of an image was found; discards transforms if none has been found for
  /// a while.
  void recordLookUp(bool is_found) {
    constexpr std::chrono::seconds kMissing{2};
    constexpr SteadyDuration kLongestWait = std::chrono::seconds(600);
    const std::lock_guard<std::mutex> lock(mutex_);
    const SteadyTime now = clock_();
    if (is_found) return missing_since_.reset();
    if (!missing_since_) missing_since_ = now;
    const bool tf_arrives = received_at_ && received_at_ > missing_since_;
    if (now - *missing_since_ < kMissing || !tf_arrives || now < next_restart_) return;
    next_restart_ = now + wait_after_restart_;
    wait_after_restart_ = std::min(2 * wait_after_restart_, kLongestWait);
    ++restarts_;
    ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                          "no poses are found for images although transforms are received: all "
                          "transforms are discarded, and new ones are collected; look for a "
                          "publisher with a wrong clock, or two publishers of the same frame");
    core_->clear();
  }

  /// Forgets all but static transforms, after a time jump.
  void clear() { core()->clear(); }

  /// The frame's newest parent; empty if there is none or it is `parent`. A parent on /tf does
  /// not count if its newest transform is over five seconds older than `stamp`.
  std::string otherParentOf(const std::string& frame, const std::string& parent,
                            const ros::Time& stamp) const {
    constexpr double kGone_s = 5.0;
    std::string other;
    if (!core()->_getParent(frame, ros::Time(0), other) || other == parent) return "";
    const ros::Time newest = findNewest(other, frame).value_or(ros::Time());  // 0: static
    return !newest.isZero() && newest.toSec() < stamp.toSec() - kGone_s ? "" : other;
  }

  void fill(dtsdf_mapping::MapStatus& status) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    status.transforms_refused = refused_;
    status.transform_restarts = restarts_;
    status.transform_age_s =
        received_at_ ? static_cast<float>(toSeconds(clock_() - *received_at_)) : -1.0f;
  }

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  static bool isLong(const std::string& name) { return name.size() > kLongestName; }

  std::shared_ptr<tf2::BufferCore> core() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return core_;
  }

  /// Makes a new buffer with the static transforms: tf2 keeps a frame that was static first so for
  /// good. @param child The frame that turned out to be on /tf. @pre The mutex is locked.
  void remake(const std::string& child) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", "frame '" << printable(child)
                                                     << "' is on /tf_static and on /tf: its static "
                                                        "transform is ignored from now on");
    core_ = std::make_shared<tf2::BufferCore>(kept_);
    for (const auto& [name, transform] : statics_) core_->setTransform(transform, "", true);
  }

  void onMessage(const Event& event, bool is_static) {
    if (ros::Time::isSimTime()) {
      const ros::Time now = ros::Time::now();
      const ros::Time last = std::exchange(last_now_, now);
      if (now < last) {
        ROS_WARN_STREAM_NAMED("dtsdf_mapping", "simulated time went back from "
                                                   << last << " to " << now
                                                   << ": transforms are discarded");
        clear();
      }
    }
    for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
      take(transform, event.getPublisherName(), is_static);
    }
  }

  /// Stamp of the newest transform between two frames; nothing if there is none.
  std::optional<ros::Time> findNewest(const std::string& parent, const std::string& frame) const {
    try {
      return core()->lookupTransform(parent, frame, ros::Time(0)).header.stamp;
    } catch (const std::runtime_error&) {
      return std::nullopt;
    }
  }

  /// Lists the frames in TF, or says why there are none.
  std::string describeFrames() const {
    std::vector<std::string> frames;
    core()->_getFrameStrings(frames);
    std::sort(frames.begin(), frames.end());
    if (!frames.empty()) {
      constexpr size_t kShown = 400;
      return "TF contains '" + printable(joined(frames, "', '"), kShown) +
             "'; start the publisher that connects the two, or set map_frame to one of these";
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    return refused_ > 0
               ? "all transforms received were refused: NaN, an invalid rotation, or no frame name"
               : "nothing has been received on /tf or /tf_static";
  }

  const SteadyClock clock_;
  const ros::Duration kept_;
  mutable std::mutex mutex_;  ///< Guards the members below, but not the buffer itself.
  std::shared_ptr<tf2::BufferCore> core_ = std::make_shared<tf2::BufferCore>(kept_);
  std::set<std::string> moving_;                                    ///< Children on /tf.
  std::map<std::string, geometry_msgs::TransformStamped> statics_;  ///< By child.
  std::optional<SteadyTime> received_at_;
  std::optional<SteadyTime> missing_since_;  ///< Time since which no image pose has been found.
  SteadyTime next_restart_;
  SteadyDuration wait_after_restart_ = std::chrono::seconds(5);
  uint64_t refused_ = 0;   ///< Without a usable name, rotation or stamp, or static and on /tf.
  uint64_t restarts_ = 0;  ///< How often recordLookUp() discarded transforms.
  ros::Time last_now_;
  ros::Subscriber tf_, tf_static_;
};

/// What is wrong with the motion from the last pose (with its stamp) to this one; nothing if it is
/// within the limits, or if this stamp is earlier than the last. A limit of 0 means no limit.
/// `last` may belong to a dropped frame: if the estimate jumps and stays there, only one frame is
/// dropped.
inline std::optional<std::string> findJump(
    const std::optional<std::pair<double, Eigen::Isometry3d>>& last, double stamp_s,
    const Eigen::Isometry3d& T_W_C, double max_speed_m_s, double max_turn_deg_s) {
  if (!last || stamp_s < last->first) return std::nullopt;
  const double interval_s = stamp_s - last->first;
  const Eigen::Isometry3d& last_T_W_C = last->second;
  constexpr double kMinInterval_s = 1e-3;  // shorter intervals give no usable speed
  const double dt = std::max(interval_s, kMinInterval_s);
  const double distance_m = (T_W_C.translation() - last_T_W_C.translation()).norm();
  const double turn_deg =
      Eigen::AngleAxisd(last_T_W_C.linear().transpose() * T_W_C.linear()).angle() * 180.0 / M_PI;
  const bool too_fast = max_speed_m_s > 0.0 && distance_m > max_speed_m_s * dt;
  const bool turns_too_fast = max_turn_deg_s > 0.0 && turn_deg > max_turn_deg_s * dt;
  if (!too_fast && !turns_too_fast) return std::nullopt;

  return formatted(
      "the pose jumped by %g m and %g degrees in %g s (limits: input/max_speed_m_s = %g, "
      "input/max_turn_deg_s = %g)",
      distance_m, turn_deg, interval_s, max_speed_m_s, max_turn_deg_s);
}

}  // namespace dtsdf
