/// A clock that stands still until a test turns its hands.
#pragma once

#include "ros/common/pace.h"

namespace dtsdf {

class FakeClock {
 public:
  void advance(double seconds) { now_ += toSteadyDuration(seconds); }

  /// Reads this clock, which has to outlive it.
  SteadyClock reader() const {
    return [this] { return now_; };
  }

 private:
  SteadyTime now_ = SteadyTime() + std::chrono::hours(1);
};

}  // namespace dtsdf
