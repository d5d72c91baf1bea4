/// What the map's and the output's thread do next, by a clock that is given, so that tests can turn
/// its hands. No ROS and no threads in here: each loop reports to its schedule what happened and
/// asks it what is due.
#pragma once

#include <chrono>
#include <functional>
#include <optional>

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

/// Bounds how often something happens.
class Pace {
 public:
  explicit Pace(double rate_hz) : period_(toSteadyDuration(1.0 / rate_hz)) {}

  bool isDue(SteadyTime now) const { return now >= next_; }
  SteadyTime next() const { return next_; }

  void setRate(double rate_hz, SteadyTime now) {
    period_ = toSteadyDuration(1.0 / rate_hz);
    if (next_ > now + period_) next_ = now + period_;
  }

  void begin(SteadyTime now) { next_ = now + period_; }
  /// What comes late by less than a period does not put off the next one.
  void beginInStep(SteadyTime now) {
    next_ = now - next_ < period_ ? next_ + period_ : now + period_;
  }
  void restUntil(SteadyTime time) {
    if (time > next_) next_ = time;
  }

 private:
  SteadyDuration period_;
  SteadyTime next_{};
};

/// What planners are answered is to be no older than a second while frames come: half of it is left
/// to the mesh and to distances.
constexpr double kLeastSpaceRate_hz = 2.0;

/// For the map's thread: frames and the mesh take turns. An extraction that is begun runs beside
/// the next frame (on a GPU) and is finished after it, or at once while no frame is there, or where
/// it is made already (on a CPU).
class MapSchedule {
 public:
  enum class Action { kFuse, kBeginMesh, kFinishMesh, kReport, kCorrect, kWait };

  /// What the thread sees when it asks.
  struct Situation {
    bool frame_ready = false;
    bool mesh_wanted = false;       ///< By listeners.
    bool space_followed = false;    ///< Surfaces of space come with the mesh.
    bool correcting = false;        ///< A correction has work, for when there is nothing else,
    bool correction_first = false;  ///< or before the next frame.
    bool mesh_made = false;         ///< Finishing it would not wait.
  };

  MapSchedule(double mesh_rate_hz, SteadyClock clock);

  void setMeshRate(double rate_hz) { mesh_pace_.setRate(rate_hz, clock_()); }
  /// Never below kLeastSpaceRate_hz.
  void setSpaceRate(double rate_hz);

  Action next(const Situation& situation) const;

  /// How long to wait at most when there is nothing to do.
  std::chrono::milliseconds idleTime(const Situation& situation) const;

  void frameFused();
  void meshBegun();
  /// Finished or lost.
  void meshEnded() { mesh_under_way_ = false; }
  /// What was extracted is not all of it.
  void meshWasPart() { fused_since_mesh_ = true; }
  /// Where the mesh takes long, frames get at least as much of the thread's time as it does.
  void meshTook(SteadyDuration duration);
  void reported();
  void cleared();
  /// By one whose mesh is not known yet.
  void mapReplaced();

  bool meshUnderWay() const { return mesh_under_way_; }
  /// The map has frames that no extraction, begun or finished, knows of.
  bool meshOutdated() const { return fused_since_mesh_; }

 private:
  std::optional<SteadyTime> nextMesh(const Situation& situation) const;

  SteadyClock clock_;
  Pace mesh_pace_;
  Pace space_pace_{kLeastSpaceRate_hz};
  Pace report_pace_;
  bool mesh_under_way_ = false;
  bool fused_since_mesh_ = false;  ///< Since the last extraction was begun.
  bool report_outdated_ = false;
};

/// For the output's thread: bounded rates, and of its time at least half to rest or to other work,
/// as it shares the cores with the map. Listeners that come late or read slowly catch up in
/// between, as fast as they read.
class OutputSchedule {
 public:
  enum class Action { kPublishMesh, kCatchUp, kPublishPoints, kWait };

  /// What there is to publish, for someone who listens.
  struct Situation {
    bool mesh_outdated = false;  ///< It has changed.
    bool mesh_behind = false;    ///< A listener has yet to get what has not changed since.
    bool points_outdated = false;
  };

  OutputSchedule(double mesh_rate_hz, double points_rate_hz, SteadyClock clock);

  void setRates(double mesh_rate_hz, double points_rate_hz);

  Action next(const Situation& situation) const;
  std::chrono::milliseconds idleTime(const Situation& situation) const;

  /// What next() said was done; it was begun at `begin` and ends now.
  void done(Action action, SteadyTime begin);

 private:
  Pace& paceOf(Action action);

  SteadyClock clock_;
  Pace mesh_pace_;
  Pace catch_up_pace_;
  Pace points_pace_;
};

}  // namespace dtsdf
