/// A clock that stands still until a test advances it.
#pragma once

#include "ros/common/pace.h"

namespace dtsdf {

class FakeClock {
 public:
  void advance(double seconds) { now_ += toSteadyDuration(seconds); }

  /// Reads this clock, which must outlive the reader.
  SteadyClock reader() const {
    return [this] { return now_; };
  }

 private:
  SteadyTime now_ = SteadyTime() + std::chrono::hours(1);
};

}  // namespace dtsdf
