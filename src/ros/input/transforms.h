/// The transforms that poses are made of: subscribed, and kept without those whose stamps cannot be
/// true.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "ros/common/schedule.h"

namespace dtsdf {

/// What the status reports about transforms.
struct TransformReport {
  uint64_t refused = 0;
  std::map<std::string, uint64_t> refused_by;  ///< "frame 'camera' of /slam: ahead of time".
  uint64_t not_kept = 0;  ///< Of frames beyond the bound, which is no fault; in `refused_by`, too.
  std::string last_refusal;     ///< In words; empty if there was none.
  std::optional<double> age_s;  ///< Wall time since the last one was taken.
};

/// tf2 keeps the transforms of a while, counted back from the newest. So a single one ahead of time
/// makes it throw all true ones away, and one at the end of time makes it throw. Here a transform
/// is refused and counted if it is ahead of the present by more than `max_ahead_s`. The present is
/// that of ROS's clock, or of the images where these are of another time, as in a recording that
/// is played without simulated time. Static transforms have no time.
///
/// tf2 forgets no name, so the number of frames is bounded: beyond `max_frames` it takes only those
/// that lead from a frame that somebody has asked for to the root. Thread safe.
class TransformBuffer {
 public:
  struct Options {
    double max_ahead_s = 5.0;
    /// Longer than any frame waits in a queue that keeps up.
    double kept_s = 30.0;
    size_t max_frames = 1000;
  };

  /// `now` is ROS's clock; 0 while it is not known.
  explicit TransformBuffer(const Options& options,
                           SteadyClock clock = std::chrono::steady_clock::now,
                           std::function<ros::Time()> now = rosTime);
  TransformBuffer() : TransformBuffer(Options()) {}

  /// False if it is refused. Where transforms of one frame stay behind its newest one by more than
  /// what is kept, that one was wrong, or time has gone back: all are forgotten, and begin anew.
  bool setTransform(const geometry_msgs::TransformStamped& transform, const std::string& publisher,
                    bool is_static = false) noexcept;

  /// Frames that poses are asked of: they are taken, however many others there are.
  void want(const std::string& frame);

  /// Whether static transforms were not kept of which one may be needed by now: they do not come
  /// again by themselves.
  bool takeStaticsWanted();

  /// An image of this stamp has come: what time it is for the images. One alone that is far ahead
  /// of the others does not say so.
  void imageCame(const ros::Time& stamp);

  /// Forgets the transforms that are not static, and the time of the images.
  void clear();

  /// A parent that a frame has by what was received, beside this one; empty: none.
  std::string otherParentOf(const std::string& frame, const std::string& parent) const;

  const tf2::BufferCore& core() const { return core_; }
  /// The frames that there are, sorted; not more than so many.
  std::vector<std::string> frames(size_t most) const;
  TransformReport report() const;

 private:
  /// The newest transform of a frame, and how many in a row were too old beside it.
  struct Track {
    ros::Time newest;
    int too_old = 0;
  };

  static ros::Time rosTime();
  std::optional<std::string> whyNot(const geometry_msgs::TransformStamped& transform) const;
  std::optional<double> present_s() const;
  void followTime(const geometry_msgs::TransformStamped& transform, const std::string& publisher);
  void refuse(const geometry_msgs::TransformStamped& transform, const std::string& publisher,
              const std::string& reason, const std::string& detail);
  bool isWanted(const std::string& frame) const;
  bool keepsNames(const std::string& child, const std::string& parent);
  void leaveOut(const std::string& child, const std::string& publisher, bool is_static);
  void clearLocked();
  double imagesTime_s() const;

  const Options options_;
  const SteadyClock clock_;
  const std::function<ros::Time()> now_;
  tf2::BufferCore core_;

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::unordered_map<std::string, Track> tracks_;
  std::unordered_set<std::string> names_;                        ///< That tf2 has.
  std::unordered_map<std::string, std::string> parents_;         ///< By child, of transforms taken.
  std::unordered_map<std::string, std::string> former_parents_;  ///< Where that has changed.
  std::deque<std::string> wanted_;  ///< The one asked for last is first.
  bool statics_left_out_ = false, statics_wanted_ = false;
  ros::Time image_stamp_;  ///< Of the newest image; 0: none.
  ros::Time ahead_stamp_;  ///< Of one far ahead of it, whose time no other has; 0: none.
  SteadyTime image_at_;    ///< When it came.
  std::optional<SteadyTime> taken_at_, warned_at_;
  TransformReport report_;  ///< Without age.
};

/// Subscribes the transforms. Callbacks come by the queue of the node handle, on one thread. Static
/// transforms are subscribed anew where the buffer had no room for one that it needs by now.
class TransformInput {
 public:
  /// `transforms` outlives it.
  TransformInput(const ros::NodeHandle& nh, TransformBuffer& transforms);

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  void onTransforms(const Event& event);
  void onStaticTransforms(const Event& event);
  void put(const Event& event, bool is_static);
  void subscribeStatic();

  ros::NodeHandle nh_;
  TransformBuffer& transforms_;
  ros::Time last_now_;
  ros::Subscriber tf_, tf_static_;
  ros::WallTimer timer_;
};

}  // namespace dtsdf
