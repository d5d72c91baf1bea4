/// A clock that only moves when a test advances it.
#pragma once

#include "ros/common/pace.h"

namespace dtsdf {

class FakeClock {
 public:
  void advance(double seconds) { now_ += toSteadyDuration(seconds); }

  /// A function that reads this clock. The clock must outlive it.
  SteadyClock reader() const {
    return [this] { return now_; };
  }

 private:
  SteadyTime now_ = SteadyTime() + std::chrono::hours(1);
};

}  // namespace dtsdf
