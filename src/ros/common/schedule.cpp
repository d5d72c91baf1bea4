#include "ros/common/schedule.h"

#include <algorithm>
#include <utility>

namespace dtsdf {
namespace {

/// How long a thread without work sleeps at most: nobody wakes it for a new listener.
constexpr std::chrono::milliseconds kIdle{50};
/// How often the report is renewed while frames come one after the other: to ask for the map's
/// counts is to wait for the GPU.
constexpr double kReportRate_hz = 10.0;
/// How often it is seen whether a listener has read, and has room for more.
constexpr double kCatchUpRate_hz = 50.0;

std::chrono::milliseconds idleUntil(SteadyTime time, SteadyTime now) {
  return std::max(std::chrono::milliseconds(0), std::min(kIdle, toMilliseconds(time - now)));
}

}  // namespace

MapSchedule::MapSchedule(double mesh_rate_hz, SteadyClock clock)
    : clock_(std::move(clock)), mesh_pace_(mesh_rate_hz), report_pace_(kReportRate_hz) {}

void MapSchedule::setSpaceRate(double rate_hz) {
  space_pace_.setRate(std::max(rate_hz, kLeastSpaceRate_hz), clock_());
}

MapSchedule::Action MapSchedule::next(const Situation& situation) const {
  const SteadyTime now = clock_();
  if (mesh_under_way_ && (fused_since_mesh_ || situation.mesh_made || !situation.frame_ready)) {
    return Action::kFinishMesh;
  }
  if (const auto due = nextMesh(situation); due && *due <= now) return Action::kBeginMesh;
  if (report_outdated_ && (!situation.frame_ready || report_pace_.isDue(now))) {
    return Action::kReport;
  }
  if (situation.frame_ready && !situation.correction_first) return Action::kFuse;
  return situation.correcting ? Action::kCorrect : Action::kWait;
}

/// None, if nobody wants it or nothing has changed.
std::optional<SteadyTime> MapSchedule::nextMesh(const Situation& situation) const {
  if (!fused_since_mesh_ || mesh_under_way_) return std::nullopt;
  std::optional<SteadyTime> next;
  if (situation.mesh_wanted) next = mesh_pace_.next();
  if (situation.space_followed)
    next = next ? std::min(*next, space_pace_.next()) : space_pace_.next();
  return next;
}

std::chrono::milliseconds MapSchedule::idleTime(const Situation& situation) const {
  const auto next = nextMesh(situation);
  return next ? idleUntil(*next, clock_()) : kIdle;
}

void MapSchedule::frameFused() { fused_since_mesh_ = report_outdated_ = true; }

void MapSchedule::meshBegun() {
  mesh_pace_.begin(clock_());
  space_pace_.begin(clock_());
  mesh_under_way_ = true;
  fused_since_mesh_ = false;
}

void MapSchedule::meshTook(SteadyDuration duration) {
  mesh_pace_.restUntil(clock_() + duration);
  space_pace_.restUntil(clock_() + duration);
  report_outdated_ = true;
}

void MapSchedule::reported() {
  report_outdated_ = false;
  report_pace_.begin(clock_());
}

void MapSchedule::cleared() {
  mesh_under_way_ = fused_since_mesh_ = false;
  report_outdated_ = true;
}

void MapSchedule::mapReplaced() {
  cleared();
  fused_since_mesh_ = true;
}

OutputSchedule::OutputSchedule(double mesh_rate_hz, double points_rate_hz, SteadyClock clock)
    : clock_(std::move(clock)),
      mesh_pace_(mesh_rate_hz),
      catch_up_pace_(kCatchUpRate_hz),
      points_pace_(points_rate_hz) {}

void OutputSchedule::setRates(double mesh_rate_hz, double points_rate_hz) {
  mesh_pace_.setRate(mesh_rate_hz, clock_());
  points_pace_.setRate(points_rate_hz, clock_());
}

OutputSchedule::Action OutputSchedule::next(const Situation& situation) const {
  const SteadyTime now = clock_();
  if (situation.mesh_outdated && mesh_pace_.isDue(now)) return Action::kPublishMesh;
  if (situation.mesh_behind && catch_up_pace_.isDue(now)) return Action::kCatchUp;
  if (situation.points_outdated && points_pace_.isDue(now)) return Action::kPublishPoints;
  return Action::kWait;
}

std::chrono::milliseconds OutputSchedule::idleTime(const Situation& situation) const {
  const SteadyTime now = clock_();
  std::chrono::milliseconds idle = kIdle;
  if (situation.mesh_outdated) idle = std::min(idle, idleUntil(mesh_pace_.next(), now));
  if (situation.mesh_behind) idle = std::min(idle, idleUntil(catch_up_pace_.next(), now));
  if (situation.points_outdated) idle = std::min(idle, idleUntil(points_pace_.next(), now));
  return idle;
}

Pace& OutputSchedule::paceOf(Action action) {
  if (action == Action::kPublishMesh) return mesh_pace_;
  return action == Action::kCatchUp ? catch_up_pace_ : points_pace_;
}

void OutputSchedule::done(Action action, SteadyTime begin) {
  if (action == Action::kWait) return;
  Pace& pace = paceOf(action);
  const SteadyTime now = clock_();
  pace.beginInStep(begin);
  pace.restUntil(now + (now - begin));
}

}  // namespace dtsdf
