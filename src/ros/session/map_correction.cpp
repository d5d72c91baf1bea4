#include "ros/session/map_correction.h"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>
#include <variant>

#include "params/printable.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// For the last records to be on the disk, before the maps are swapped.
constexpr std::chrono::milliseconds kLogWait{20};

template <class Value>
bool isReady(const Value& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

const char kNothingMoves[] = "no frame moves";

double secondsSince(SteadyTime time) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - time).count();
}

std::string describe(const CorrectionEffect& effect) {
  return formatted("%zu frames moved, by up to %g m and %g rad", effect.moved, effect.farthest_m,
                   effect.farthest_rad);
}

std::string gapOf(const LogReport& log) {
  return "the frame log lacks a part of the map" +
         (log.problem.empty() ? "" : " (" + log.problem + ")") +
         "; a correction can be made of what is logged from now on";
}

}  // namespace

void MapCorrection::add(Request request, const MapStats& live) {
  Pending pending;
  pending.request = std::move(request);
  pending.came = std::chrono::steady_clock::now();
  try {
    if (isForNothing(pending.request)) return answer(pending, kNothingMoves);
    const std::string problem = whyTooLarge(live);
    if (!problem.empty()) throw std::runtime_error(problem);
  } catch (const std::exception& error) {
    return refuse(pending, errorText(error));
  }
  pending.correction.poses = std::move(pending.request.poses);
  pending.mark = log_.mark().share();
  waiting_.push_back(std::move(pending));
  noteProgress();
}

/// Known without the log: a SLAM may say every second that nothing has changed.
bool MapCorrection::isForNothing(Request& request) const {
  if (!log_.hasImages() || fused_.empty()) {
    throw std::runtime_error("no frame has been fused since the start, clear_map or load_map");
  }
  const PoseCorrection correction(request.poses, fused_);
  leaveOutLost(correction, request);
  if (request.poses.empty()) return true;
  return waiting_.empty() && joined_.empty() && correction.farthest() < request.least;
}

/// What is older than the log cannot move; a SLAM's path names it all the same. Not once a
/// recording has begun anew: the log may hold all of it, behind later stamps.
void MapCorrection::leaveOutLost(const PoseCorrection& correction, Request& request) const {
  const std::optional<double> first_s = log_.report().first_stamp_s;
  if (!first_s || has_begun_anew_) return;
  const double from_s = *first_s - PoseCorrection::kSameStamp_s;
  const std::optional<double> moved_s =
      correction.firstMoved_s(std::max(request.least, PoseCorrection::kLeast));
  if (moved_s && *moved_s < from_s) throw std::runtime_error(reachesBack(*moved_s, *first_s));
  const auto isLost = [&](const StampedPose& pose) { return pose.stamp_s < from_s; };
  std::vector<StampedPose>& poses = request.poses;
  poses.erase(std::remove_if(poses.begin(), poses.end(), isLost), poses.end());
}

bool MapCorrection::isMarked() const { return !waiting_.empty() && isReady(waiting_.front().mark); }

bool MapCorrection::hasWork() const {
  return refusion_ != nullptr || (opening_.valid() ? isReady(opening_) : isMarked());
}

std::optional<MapCorrection::Corrected> MapCorrection::step(const MapStats& live) {
  if (refusion_ == nullptr) {
    if (opening_.valid()) {
      takeOpened();
    } else {
      openLog();
    }
    return std::nullopt;
  }
  std::string problem = "unknown error";
  try {
    join();
    return fuseAgain(live);
  } catch (const std::exception& error) {
    problem = errorText(error);
  } catch (...) {
  }
  refuseJoined(problem);
  freeLater(std::move(refusion_));
  noteProgress();
  return std::nullopt;
}

std::optional<MapCorrection::Corrected> MapCorrection::fuseAgain(const MapStats& live) {
  std::optional<Corrected> corrected;
  if (joined_.empty()) {
    freeLater(std::move(refusion_));
  } else if (refusion_->hasToBegin()) {
    begin();
  } else {
    const bool has_fused = refusion_->step(live.map_bytes);
    catch_up_.turn(has_fused);
    if (!has_fused && hasCaughtUp()) {
      corrected.emplace();
      corrected->mesh = refusion_->takeMesh();
      corrected->mapper = refusion_->takeMapper();
    }
  }
  noteProgress();
  return corrected;
}

void MapCorrection::openLog() {
  if (!isMarked()) return;
  const Mark mark = waiting_.front().mark.get();
  life_ = mark ? mark->life : 0;
  has_begun_again_ = is_closed_ = false;
  opening_ = helper_.run(
      [folder = log_.folder(), run = run_] { return std::make_unique<Refusion>(folder, run); });
}

void MapCorrection::begin() {
  catch_up_ = CatchUp();
  opening_ = helper_.run([refusion = std::move(refusion_)]() mutable {
    refusion->begin();
    return std::move(refusion);
  });
}

void MapCorrection::takeOpened() {
  if (!isReady(opening_)) return;
  const bool in_vain = std::exchange(is_opening_in_vain_, false);
  try {
    refusion_ = opening_.get();
    if (in_vain) freeLater(std::move(refusion_));
  } catch (const std::exception& error) {
    if (in_vain) return;
    if (joined_.empty()) {
      refuse(waiting_.front(), errorText(error));
      waiting_.pop_front();
    }
    refuseJoined(errorText(error));
    noteProgress();
  }
}

/// One of a log that has begun anew waits until the others are refused, which lack the rest.
void MapCorrection::join() {
  while (!is_closed_ && isMarked()) {
    Pending& next = waiting_.front();
    const Mark mark = next.mark.get();
    if (mark && mark->life > life_) throw std::runtime_error(gapOf(log_.report()));
    bool is_joined = false;
    try {
      is_joined = joins(next);
    } catch (const std::exception& error) {
      refuse(next, errorText(error));
    }
    if (is_joined) joined_.push_back(std::move(next));
    if (!is_closed_) waiting_.pop_front();
  }
}

/// Where nothing more moves it is answered with those before it, by which it may be so.
bool MapCorrection::joins(Pending& next) {
  next.correction.before = numberOf(next.mark.get());
  next.effect = refusion_->effectOf(next.correction);
  if (next.effect.moved == 0 ||
      std::max(next.effect.farthest_m, next.effect.farthest_rad) < next.request.least) {
    next.effect = {};
    if (!joined_.empty()) return true;
    answer(next, kNothingMoves);
    return false;
  }
  if (refusion_->isTooLateFor(next.effect)) {
    is_closed_ = has_begun_again_;
    if (is_closed_) return false;
    has_begun_again_ = true;
  }
  refusion_->correct(next.correction);
  return true;
}

/// While it waits, nothing is added to the log.
bool MapCorrection::hasCaughtUp() {
  std::future<Mark> mark = log_.mark();
  if (mark.wait_for(kLogWait) != std::future_status::ready) return false;
  return numberOf(mark.get()) == refusion_->nextNumber();
}

/// Of a mark in the log that is open: one that has begun anew since counts anew.
uint64_t MapCorrection::numberOf(const Mark& mark) const {
  if (mark && mark->life == life_) return mark->number;
  throw std::runtime_error(gapOf(log_.report()));
}

void MapCorrection::finish(std::unique_ptr<Mapper> replaced) {
  for (const LogCorrection& correction : refusion_->corrections()) log_.corrected(correction);
  T_W_S_ = refusion_->motion() * T_W_S_;
  updateFused();
  for (const Pending& pending : joined_) {
    if (pending.effect.moved == 0) {
      answer(pending, kNothingMoves);
      continue;
    }
    answer(pending, describe(pending.effect) +
                        formatted("; %zu fused again in %g s", refusion_->fused(),
                                  std::round(100.0 * secondsSince(pending.came)) / 100.0));
  }
  joined_.clear();
  freeLater(std::move(refusion_));
  freeLater(std::move(replaced));
  noteProgress();
}

/// Large maps take long to be freed.
template <class Object>
void MapCorrection::freeLater(std::unique_ptr<Object> object) {
  helper_.run([object = std::move(object)]() mutable { object.reset(); });
}

/// What the log no longer has stays where it is.
void MapCorrection::updateFused() {
  std::vector<StampedPose> fused = refusion_->firstCamera();
  const double from_s = fused.front().stamp_s - PoseCorrection::kSameStamp_s;
  const auto logged = std::find_if(fused_.begin(), fused_.end(),
                                   [&](const StampedPose& pose) { return pose.stamp_s >= from_s; });
  fused.insert(fused.begin(), fused_.begin(), logged);
  fused_ = std::move(fused);
}

void MapCorrection::giveUp(const std::string& reason) {
  refuseJoined(reason);
  for (const Pending& pending : waiting_) refuse(pending, reason);
  waiting_.clear();
  if (refusion_) freeLater(std::move(refusion_));
  is_opening_in_vain_ = opening_.valid();
  fused_.clear();
  has_begun_anew_ = false;
  T_W_S_ = Eigen::Isometry3d::Identity();
  noteProgress();
}

/// Once it is known that the log grows faster, its frames go first.
void MapCorrection::noteFrame() {
  if (!isFusing() || !catch_up_.newFrame()) return;
  ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                        "frames arrive faster than the correction of those before can fuse them "
                        "as well: until it is done, two logged frames are fused for each new one, "
                        "and new ones may be dropped");
}

void MapCorrection::place(PosedFrame& frame) {
  noteFrame();
  auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth != nullptr && frame.camera == 0) {
    const StampedPose given{frame.stamp.toSec(), depth->T_W_C};
    if (given_.takesOver(T_W_S_, given)) T_W_S_ = Eigen::Isometry3d::Identity();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (report_.camera_frame != frame.frame_id) report_.camera_frame = frame.frame_id;
  }
  if (T_W_S_.matrix() == Eigen::Isometry3d::Identity().matrix()) return;
  std::visit([&](auto& image) { image.T_W_C = T_W_S_ * image.T_W_C; }, frame.image);
  if (depth != nullptr && depth->keep_center_W) {
    depth->keep_center_W = T_W_S_ * *depth->keep_center_W;
  }
}

void MapCorrection::wasFused(const PosedFrame& frame) {
  const auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth == nullptr || frame.camera != 0) return;
  const double stamp_s = frame.stamp.toSec();
  if (!fused_.empty() && stamp_s < fused_.back().stamp_s - GivenMotion::kBegin_s) {
    fused_.clear();
    has_begun_anew_ = true;
  }
  if (fused_.empty() || stamp_s > fused_.back().stamp_s) fused_.push_back({stamp_s, depth->T_W_C});
}

void MapCorrection::answer(const Pending& pending, const std::string& message) {
  CorrectionResult result;
  result.success = true;
  result.moved = pending.effect.moved;
  result.fused = result.moved == 0 ? 0 : refusion_->fused();
  result.seconds = secondsSince(pending.came);
  result.message = message;
  pending.request.answer(result);
  if (result.moved == 0) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.last = result.message;
}

void MapCorrection::refuse(const Pending& pending, const std::string& reason) {
  CorrectionResult result;
  result.message = reason;
  pending.request.answer(result);
  noteRefused(reason);
}

void MapCorrection::noteRefused(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.last = "refused: " + reason;
}

void MapCorrection::refuseJoined(const std::string& reason) {
  for (const Pending& pending : joined_) refuse(pending, reason);
  joined_.clear();
}

void MapCorrection::noteProgress() {
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.waiting = waiting_.size() + joined_.size();
  report_.fused = refusion_ == nullptr ? 0 : refusion_->fused();
  report_.total = refusion_ == nullptr ? 0 : refusion_->total();
  report_.bytes = refusion_ == nullptr ? 0 : refusion_->bytes();
}

CorrectionReport MapCorrection::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return report_;
}

}  // namespace dtsdf
