/// The transforms that poses are made of, without those whose stamps cannot be true.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "ros/common/steady_clock.h"

namespace dtsdf {

/// What the status tells about transforms.
struct TransformReport {
  uint64_t refused = 0;
  std::map<std::string, uint64_t> refused_by;  ///< "frame 'camera' of /slam: ahead of time".
  std::string last_refusal;                    ///< In words; empty if there was none.
  std::optional<double> age_s;                 ///< Wall time since the last one was taken.
};

/// tf2 keeps the transforms of a while, counted back from the newest. So a single one ahead of time
/// makes it throw all true ones away, and one at the end of time makes it throw. Here a transform
/// is refused and counted if it is ahead of the present by more than `max_ahead_s`. The present is
/// that of ROS's clock, or of the images where these are of another time, as in a recording that
/// is played without simulated time. Static transforms have no time. Thread safe.
class TransformBuffer {
 public:
  struct Options {
    double max_ahead_s = 5.0;
    /// Longer than any frame waits in a queue that keeps up.
    double kept_s = 30.0;
  };

  /// `now` is ROS's clock; 0 while it is not known.
  explicit TransformBuffer(Options options, SteadyClock clock = std::chrono::steady_clock::now,
                           std::function<ros::Time()> now = rosTime);
  TransformBuffer() : TransformBuffer(Options()) {}

  /// False if it is refused. Where transforms of one frame stay behind its newest one by more than
  /// what is kept, that one was wrong, or time has gone back: all are forgotten, and begin anew.
  bool setTransform(const geometry_msgs::TransformStamped& transform, const std::string& publisher,
                    bool is_static = false) noexcept;

  /// An image of this stamp has come: what time it is for the images.
  void imageCame(const ros::Time& stamp);

  /// Forgets the transforms that are not static, and the time of the images.
  void clear();

  const tf2::BufferCore& core() const { return core_; }
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
  void clearLocked();

  const Options options_;
  const SteadyClock clock_;
  const std::function<ros::Time()> now_;
  tf2::BufferCore core_;

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::unordered_map<std::string, Track> tracks_;
  ros::Time image_stamp_;     ///< Of the newest image; 0: none.
  SteadyTime image_at_;       ///< When it came.
  std::optional<SteadyTime> taken_at_, warned_at_;
  TransformReport report_;    ///< Without age.
};

}  // namespace dtsdf
