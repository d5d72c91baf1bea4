/// Counts what became of every frame and warns, throttled, about those that were dropped.
#pragma once

#include <ros/time.h>

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "ros/common/steady_clock.h"
#include "ros/input/drop_reason.h"

namespace dtsdf {

struct FrameCounts {
  uint64_t images = 0;
  uint64_t camera_infos = 0;
  uint64_t fused = 0;
  std::array<uint64_t, kDropReasonCount> dropped{};
  ros::Time last_stamp;  ///< Of the image received last.
  ros::Time last_fused_stamp;
  std::string last_drop;  ///< Stamp, reason and text of the newest dropped frame.

  /// Wall time since the last one of each; nothing if there was none.
  std::optional<double> image_age_s, camera_info_age_s, fused_age_s;

  uint64_t droppedSum() const;
  /// Received, and neither fused nor dropped: they wait somewhere in the node, or are being fused.
  uint64_t waiting() const { return images - fused - droppedSum(); }
};

/// Of the images of one stream. Thread safe: callbacks, intake and map all count here.
class FrameAccounting {
 public:
  /// `name` begins the warnings, where there are several streams.
  explicit FrameAccounting(std::string name = "",
                           SteadyClock clock = std::chrono::steady_clock::now)
      : name_(std::move(name)), clock_(std::move(clock)) {}

  void imageReceived(const ros::Time& stamp);
  void cameraInfoReceived();
  void fused(const ros::Time& stamp);
  void dropped(DropReason reason, const ros::Time& stamp, const std::string& text);

  FrameCounts counts() const;

 private:
  bool mayWarn(DropReason reason);
  std::optional<double> ageOf(const std::optional<SteadyTime>& time) const;

  const std::string name_;
  const SteadyClock clock_;
  mutable std::mutex mutex_;
  FrameCounts counts_;  ///< Without ages.
  std::optional<SteadyTime> image_at_, camera_info_at_, fused_at_;
  std::array<ros::WallTime, kDropReasonCount> last_warning_{};
};

}  // namespace dtsdf
