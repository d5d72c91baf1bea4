/// The clock that is given to whatever has deadlines, so that tests can turn its hands.
#pragma once

#include <chrono>
#include <functional>

namespace dtsdf {

using SteadyTime = std::chrono::steady_clock::time_point;
using SteadyDuration = std::chrono::steady_clock::duration;
using SteadyClock = std::function<SteadyTime()>;

inline SteadyDuration toSteadyDuration(double seconds) {
  return std::chrono::duration_cast<SteadyDuration>(std::chrono::duration<double>(seconds));
}

/// Rounded up: who sleeps so long finds the time has come.
inline std::chrono::milliseconds toMilliseconds(SteadyDuration duration) {
  return std::chrono::ceil<std::chrono::milliseconds>(duration);
}

}  // namespace dtsdf
