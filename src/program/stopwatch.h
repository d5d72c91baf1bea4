/// What work takes: time on the wall, and of the processor.
#pragma once

#include <chrono>
#include <ctime>

namespace dtsdf {

/// Wall time since then.
inline double millisecondsSince(std::chrono::steady_clock::time_point begin) {
  const auto now = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::milli>(now - begin).count();
}

/// Time of all threads so far: on a machine with other work it says more than wall time.
inline double processorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace dtsdf
