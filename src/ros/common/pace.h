/// Clocks for timeouts, and a rate limiter.
#pragma once

#include <ros/time.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <mutex>

namespace dtsdf {

using SteadyTime = std::chrono::steady_clock::time_point;
using SteadyDuration = std::chrono::steady_clock::duration;
using SteadyClock = std::function<SteadyTime()>;

inline SteadyDuration toSteadyDuration(double seconds) {
  return std::chrono::duration_cast<SteadyDuration>(std::chrono::duration<double>(seconds));
}

inline double toSeconds(SteadyDuration duration) {
  return std::chrono::duration<double>(duration).count();
}

/// Rounds up, so that a sleep of this length does not end too early.
inline std::chrono::milliseconds toMilliseconds(SteadyDuration duration) {
  return std::chrono::ceil<std::chrono::milliseconds>(duration);
}

/// Clock for the timeouts of images that wait for other messages or for their pose. It follows wall
/// time, but advances no faster than simulated time. If simulated time stops for a second, as at
/// the end of a bag, the clock follows wall time until simulated time advances again.
inline SteadyTime waitingTime() {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  const SteadyTime wall = std::chrono::steady_clock::now();
  if (!ros::Time::isSimTime()) return wall;
  static SteadyTime time = wall, counted_to = wall, moved_at = wall;
  static ros::Time before;
  const ros::Time now = ros::Time::now();
  const SteadyTime stopped_at = moved_at + std::chrono::seconds(1);
  if (now != before) {
    const double simulated_s = std::clamp(now.toSec() - before.toSec(), 0.0, 1e6);
    time += std::min(wall - counted_to, toSteadyDuration(simulated_s));
    counted_to = moved_at = wall;
  } else if (wall > stopped_at) {
    time += wall - std::max(counted_to, stopped_at);
    counted_to = wall;
  }
  before = now;
  return time;
}

/// Limits the rate of a recurring task.
class Pace {
 public:
  explicit Pace(double rate_hz) : period_(toSteadyDuration(1.0 / rate_hz)) {}

  bool isDue(SteadyTime now) const { return now >= next_; }
  SteadyTime next() const { return next_; }

  /// Changes the rate. A higher rate brings the next start forward.
  void setRate(double rate_hz, SteadyTime now) {
    const SteadyDuration period = toSteadyDuration(1.0 / rate_hz);
    if (period == period_) return;
    period_ = period;
    if (next_ > now + period_) next_ = now + period_;
  }

  void begin(SteadyTime now) { next_ = now + period_; }
  /// A start that is late by less than a period does not delay the next one.
  void beginInStep(SteadyTime now) {
    next_ = now - next_ < period_ ? next_ + period_ : now + period_;
  }
  /// Call this when work that began at `begun` has ended. The next start is at least a period after
  /// `begun`, and at least `rests` times the duration of the work after its end.
  void end(SteadyTime begun, int rests = 1) {
    const SteadyTime now = std::chrono::steady_clock::now();
    begin(begun);
    restUntil(now + rests * (now - begun));
  }
  void restUntil(SteadyTime time) {
    if (time > next_) next_ = time;
  }

 private:
  SteadyDuration period_;
  SteadyTime next_{};
};

}  // namespace dtsdf
