/// Measures wall time and processor time.
#pragma once

#include <chrono>
#include <ctime>

namespace dtsdf {

/// Wall time since `begin`, in milliseconds.
inline double millisecondsSince(std::chrono::steady_clock::time_point begin) {
  const auto now = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::milli>(now - begin).count();
}

/// Processor time of all threads so far; more reliable than wall time on a busy machine.
inline double processorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace dtsdf
