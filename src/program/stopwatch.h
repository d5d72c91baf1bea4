/// What work takes: time on the wall, and of the processor.
#pragma once

#include <chrono>
#include <ctime>

namespace dtsdf {

/// The time since it was made.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double milliseconds() const { return 1e3 * seconds(); }

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start_ = Clock::now();
};

/// Time of all threads so far: on a machine with other work it says more than wall time.
inline double processorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace dtsdf
