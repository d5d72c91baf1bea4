/// How many depth images were dropped lately, and why.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "ros/common/steady_clock.h"
#include "ros/input/camera_report.h"

namespace dtsdf {

/// Of one camera's depth, within the last while.
struct DropShare {
  uint64_t received = 0;
  uint64_t dropped = 0;  ///< For reasons that are a fault: not as mapping is paused.
  DropReason most_common = DropReason::kQueueFull;
};

/// Updated at each status.
class RecentDrops {
 public:
  /// Of each camera, in their order.
  std::vector<DropShare> update(const std::vector<CameraReport>& cameras, SteadyTime now);

 private:
  struct Moment {
    SteadyTime at;
    std::vector<FrameCounts> frames;
  };

  std::deque<Moment> moments_;
};

/// What to do against drops for a reason; empty where the text of the last drop has to do.
const char* remedyFor(DropReason reason);

}  // namespace dtsdf
