/// The transforms that poses are made of: received, kept by tf2, and looked up in words.
#pragma once

#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "ros/common/pace.h"

namespace dtsdf {

struct PoseAnswer {
  std::optional<Eigen::Isometry3d> T_W_C = std::nullopt;  ///< Nothing if it is not known.
  bool may_come = false;  ///< Unless the transforms that are known are all newer than the stamp.
  std::string text = {};  ///< What is missing, and what the newest transform is.
};

/// What the status reports about transforms.
struct TransformReport {
  uint64_t refused = 0;         ///< Without a usable name, a rotation, or a stamp.
  uint64_t restarts = 0;        ///< How often the buffer was made new.
  std::string last_restart;     ///< Why, the last time; empty: never.
  std::optional<double> age_s;  ///< Wall time since the last one was received.
};

/// tf2's buffer. It takes every transform as it comes, so a single one with a wrong stamp can make
/// it refuse all true ones. Where images find no pose for a while although transforms are received,
/// the buffer is therefore made new: with the static transforms so far, except those of frames that
/// are on /tf too, which are ignored from then on. Thread safe.
class Transforms {
 public:
  explicit Transforms(SteadyClock clock = std::chrono::steady_clock::now);

  /// Receives /tf and /tf_static, on the queue of the node handle.
  void subscribe(ros::NodeHandle nh);

  void take(const geometry_msgs::TransformStamped& transform, const std::string& publisher,
            bool is_static = false);

  /// The pose of a frame in another one at a stamp; 0: by the newest transform. `what` is of the
  /// stamp, in words.
  PoseAnswer find(const std::string& parent, const std::string& frame, const ros::Time& stamp,
                  const char* what = "the request") const;

  /// What became of the look-up for an image that has waited for its pose.
  void notePose(bool is_found);

  /// Forgets the transforms that are not static, after a jump of time.
  void clear();

  /// The parent that a frame has, if it is another one; else empty.
  std::string otherParentOf(const std::string& frame, const std::string& parent) const;

  TransformReport report() const;

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;
  using Core = std::shared_ptr<tf2::BufferCore>;

  void onMessage(const Event& event, bool is_static);
  Core core() const;
  Core makeCore() const;
  void restart(const std::string& why);

  const SteadyClock clock_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  Core core_;
  std::map<std::string, geometry_msgs::TransformStamped> statics_;  ///< By child.
  std::set<std::string> moving_;                                    ///< Children on /tf.
  std::set<std::string> ignored_statics_;
  std::optional<SteadyTime> received_at_, missing_since_;
  int missing_ = 0;  ///< Images in a row.
  std::optional<SteadyTime> restarted_at_;
  SteadyDuration next_restart_after_;
  TransformReport report_;  ///< Without age.
  ros::Time last_now_;
  ros::Subscriber tf_, tf_static_;
};

}  // namespace dtsdf
