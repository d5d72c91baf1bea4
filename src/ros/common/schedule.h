/// What the map's and the output's thread do next. No ROS and no threads in here, and the clock is
/// given: each loop tells its schedule what happened and asks it what is due.
#pragma once

#include "ros/common/steady_clock.h"

namespace dtsdf {

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
  void restUntil(SteadyTime time) {
    if (time > next_) next_ = time;
  }

 private:
  SteadyDuration period_;
  SteadyTime next_{};
};

/// For the map's thread: frames, the mesh and what is told of space take turns. An extraction that
/// is begun runs beside the next frame (on a GPU) and is finished after it, or at once while no
/// frame is there.
class MapSchedule {
 public:
  enum class Action { kFuse, kBeginMesh, kFinishMesh, kTellSpace, kReport, kWait };

  /// What the thread sees when it asks.
  struct Situation {
    bool frame_ready = false;
    bool mesh_wanted = false;
    bool space_wanted = false;  ///< Somebody follows what is known of space,
    bool space_lacking = false;  ///< and has been told nothing so far.
  };

  MapSchedule(double mesh_rate_hz, SteadyClock clock);

  void setMeshRate(double rate_hz) { mesh_pace_.setRate(rate_hz, clock_()); }
  void setSpaceRate(double rate_hz) { space_pace_.setRate(rate_hz, clock_()); }

  Action next(const Situation& situation) const;

  /// How long to wait at most when there is nothing to do.
  std::chrono::milliseconds idleTime(const Situation& situation) const;

  void frameFused();
  void meshBegun();
  /// Finished or lost.
  void meshEnded() { mesh_under_way_ = false; }
  /// Where the mesh takes long, frames get at least as much of the thread's time as it does.
  void meshTook(SteadyDuration duration);
  /// Surfaces have changed, and are told once their mesh is finished. As that may be after one more
  /// frame was fused, cells may be told free by later frames than surfaces are of.
  void spaceChanged() { space_outdated_ = true; }
  /// It was begun at `begin` and ends now.
  void spaceTold(SteadyTime begin);
  void reported();
  void cleared();
  /// By one whose mesh is not known yet.
  void mapReplaced();

  bool meshUnderWay() const { return mesh_under_way_; }
  /// The map has frames that no extraction, begun or finished, knows of.
  bool meshOutdated() const { return fused_since_mesh_; }

 private:
  bool wantsMesh(const Situation& situation) const;
  bool wantsSpace(const Situation& situation) const;

  SteadyClock clock_;
  Pace mesh_pace_;
  Pace space_pace_{1.0};
  Pace report_pace_;
  bool mesh_under_way_ = false;
  bool fused_since_mesh_ = false;  ///< Since the last extraction was begun.
  bool space_outdated_ = false;    ///< As it was told last.
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
