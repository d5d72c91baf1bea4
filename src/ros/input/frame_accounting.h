/// Counts what became of every frame and warns, throttled, about those that were dropped.
#pragma once

#include <ros/time.h>

#include <array>
#include <cstdint>
#include <mutex>
#include <string>

#include "ros/input/drop_reason.h"

namespace dtsdf {

struct FrameCounts {
  uint64_t images = 0;
  uint64_t camera_infos = 0;
  uint64_t fused = 0;
  std::array<uint64_t, kDropReasonCount> dropped{};
  ros::Time last_fused_stamp;
  std::string last_drop;  ///< Stamp, reason and text of the newest dropped frame.

  uint64_t droppedSum() const;
};

/// Thread safe: callbacks, intake and map all count here.
class FrameAccounting {
 public:
  void imageReceived();
  void cameraInfoReceived();
  void fused(const ros::Time& stamp);
  void dropped(DropReason reason, const ros::Time& stamp, const std::string& text);

  FrameCounts counts() const;

 private:
  bool mayWarn(DropReason reason);

  mutable std::mutex mutex_;
  FrameCounts counts_;
  std::array<ros::WallTime, kDropReasonCount> last_warning_{};
};

}  // namespace dtsdf
