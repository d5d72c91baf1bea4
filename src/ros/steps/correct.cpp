#include "ros/steps/correct.h"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>
#include <variant>

#include <dtsdf_mapping/CorrectPoses.h>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {
namespace {

/// For the last records to be on the disk, before the maps are swapped.
constexpr std::chrono::milliseconds kLogWait{20};

template <class Value>
bool isReady(const Value& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

const char kOnlyByTf[] = "frames can be moved only where poses/mode is tf";
/// How often who waits for a correction looks whether the node ends.
constexpr std::chrono::milliseconds kLookForTheEnd(100);

const char kNothingMoves[] = "no frame moves";

double secondsSince(SteadyTime time) { return toSeconds(std::chrono::steady_clock::now() - time); }

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

CorrectStep::CorrectStep(const Host& host, JournalStep* journal) : host_(host), journal_(journal) {}

CorrectStep::~CorrectStep() { giveUp("the node ends"); }

void CorrectStep::advertise(const Handles& handles) {
  using dtsdf_mapping::CorrectPoses;
  server_ = serve<CorrectPoses>(
      handles.waiting, "correct_poses", [this](const auto& request, auto& response) {
        const std::string path = resolveOutputPath(host_.params.node.output_directory,
                                                   request.file_name, {".txt", ".tum"});
        GivenPoses given;
        given.poses = readTrajectory(path, "give a TUM file in output_directory").poses();
        given.frame_id = request.frame_id;
        given.child_frame = request.child_frame;
        CorrectionResult result;
        correctByCall(given, result);
        response.message = result.message;
        response.moved = result.moved;
        response.fused = result.fused;
        response.seconds = result.seconds;
      });
  if (journal_ == nullptr) return;
  if (host_.params.node.poses.mode != PoseMode::kTf) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", "corrected_path is not subscribed: " << kOnlyByTf);
    return;
  }
  const std::string& ns = handles.prompt.getNamespace();
  const boost::function<void(const nav_msgs::Path::ConstPtr&)> callback =
      [this](const nav_msgs::Path::ConstPtr& path) {
        guarded("corrected_path", [&] {
          try {
            followPath(readPath(*path, host_.params.node.corrections.path_frame));
          } catch (const std::exception& error) {
            noteRefused(errorText(error));
          }
        });
      };
  // Of several that wait only the newest counts.
  ros::NodeHandle nh = handles.input;
  path_input_ =
      nh.subscribe<nav_msgs::Path>(ns.substr(0, ns.rfind('/')) + "/corrected_path", 1, callback);
}

/// Input's thread. A path that was not looked at yet is replaced.
void CorrectStep::followPath(GivenPoses given) {
  if (given.poses.empty()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    path_ = std::move(given);
  }
  host_.map_loop.wake();
}

void CorrectStep::requireJournal() const {
  if (host_.params.node.poses.mode != PoseMode::kTf) throw std::runtime_error(kOnlyByTf);
  if (journal_ != nullptr) return;
  throw std::runtime_error(
      "frames can be moved only if they are logged; start the node with log/folder");
}

/// In the map, of the camera.
std::vector<StampedPose> CorrectStep::cameraPoses(const GivenPoses& given) const {
  const Eigen::Isometry3d T_W_F = host_.frame.find(given.frame_id);
  Eigen::Isometry3d T_B_C = Eigen::Isometry3d::Identity();
  if (!given.child_frame.empty()) {
    std::string camera;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      camera = report_.camera_frame;
    }
    if (camera.empty()) throw std::runtime_error("no frame has been received yet");
    const PoseAnswer mount = host_.transforms.find(given.child_frame, camera, ros::Time(0));
    if (mount.kind != PoseAnswer::Kind::kKnown) throw std::runtime_error(mount.text);
    T_B_C = mount.T_W_C;
  }
  std::vector<StampedPose> poses;
  poses.reserve(given.poses.size());
  for (const StampedPose& pose : given.poses) {
    poses.push_back({pose.stamp_s, T_W_F * pose.T_W_C * T_B_C});
  }
  return poses;
}

/// Waits until it is answered. @throws std::runtime_error where it is refused.
void CorrectStep::correctByCall(const GivenPoses& given, CorrectionResult& result) {
  requireJournal();
  const auto done = std::make_shared<std::promise<CorrectionResult>>();
  std::future<CorrectionResult> answer = done->get_future();
  Request request{cameraPoses(given), 0.0,
                  [done](const CorrectionResult& outcome) { done->set_value(outcome); }};
  host_.map_loop.run([&] { add(std::move(request)); }).get();
  while (answer.wait_for(kLookForTheEnd) != std::future_status::ready) {
    if (host_.is_ending) throw std::runtime_error("the node ends");
  }
  result = answer.get();
  if (!result.success) throw std::runtime_error(result.message);
}

/// Map's thread: looks at the path that came last.
void CorrectStep::takePath() {
  std::optional<GivenPoses> given;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    given.swap(path_);
  }
  if (!given) return;
  const auto answer = [](const CorrectionResult& result) {
    if (result.success && result.moved > 0) {
      ROS_INFO_STREAM_NAMED("dtsdf_mapping", "corrected_path: " << result.message);
    } else if (!result.success) {
      ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping",
                                     "corrected_path is refused: " << result.message);
    }
  };
  try {
    add({cameraPoses(*given), host_.params.node.corrections.least_m, answer});
  } catch (const std::exception& error) {
    noteRefused(errorText(error));
  }
}

void CorrectStep::add(Request request) {
  host_.map.throwIfFailed();
  Pending pending;
  pending.request = std::move(request);
  pending.came = std::chrono::steady_clock::now();
  try {
    if (isForNothing(pending.request)) return answer(pending, kNothingMoves);
    const std::string problem = whyTooLarge(host_.map.mapper().stats());
    if (!problem.empty()) throw std::runtime_error(problem);
  } catch (const std::exception& error) {
    return refuse(pending, errorText(error));
  }
  pending.correction.poses = std::move(pending.request.poses);
  pending.mark = journal_->mark().share();
  waiting_.push_back(std::move(pending));
  noteProgress();
}

/// Known without the log: a SLAM may say every second that nothing has changed.
bool CorrectStep::isForNothing(Request& request) const {
  if (!journal_->hasImages() || fused_.empty()) {
    throw std::runtime_error("no frame has been fused since the start, clear_map or load_map");
  }
  const PoseCorrection correction(request.poses, fused_);
  leaveOutLost(correction, request);
  if (request.poses.empty()) return true;
  return waiting_.empty() && joined_.empty() && correction.farthest() < request.least;
}

/// What is older than the log cannot move; a SLAM's path names it all the same. Not once a
/// recording has begun anew: the log may hold all of it, behind later stamps.
void CorrectStep::leaveOutLost(const PoseCorrection& correction, Request& request) const {
  const std::optional<double> first_s = journal_->report().first_stamp_s;
  if (!first_s || has_begun_anew_) return;
  const double from_s = *first_s - PoseCorrection::kSameStamp_s;
  const std::optional<double> moved_s =
      correction.firstMoved_s(std::max(request.least, PoseCorrection::kLeast));
  if (moved_s && *moved_s < from_s) throw std::runtime_error(reachesBack(*moved_s, *first_s));
  const auto isLost = [&](const StampedPose& pose) { return pose.stamp_s < from_s; };
  std::vector<StampedPose>& poses = request.poses;
  poses.erase(std::remove_if(poses.begin(), poses.end(), isLost), poses.end());
}

bool CorrectStep::isMarked() const { return !waiting_.empty() && isReady(waiting_.front().mark); }

/// What is done by another thread takes no time of this one, so it goes before frames.
Step::Work CorrectStep::hasWork() const {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (path_) return Work::kBeforeFrames;
  }
  const bool has_work = refusion_ != nullptr || (opening_.valid() ? isReady(opening_) : isMarked());
  if (!has_work) return Work::kNone;
  return !isFusing() || catch_up_.isLogsTurn() ? Work::kBeforeFrames : Work::kWhenIdle;
}

void CorrectStep::work() {
  takePath();
  if (refusion_ == nullptr) return opening_.valid() ? takeOpened() : openLog();
  std::string problem = "unknown error";
  try {
    join();
    return fuseAgain();
  } catch (const std::exception& error) {
    problem = errorText(error);
  } catch (...) {
  }
  refuseJoined(problem);
  freeLater(std::move(refusion_));
  noteProgress();
}

void CorrectStep::fuseAgain() {
  if (joined_.empty()) {
    freeLater(std::move(refusion_));
  } else if (refusion_->hasToBegin()) {
    begin();
  } else {
    const bool has_fused = refusion_->step(host_.map.stats().map_bytes);
    catch_up_.turn(has_fused);
    if (!has_fused && hasCaughtUp()) return finish();
  }
  noteProgress();
}

void CorrectStep::openLog() {
  if (!isMarked()) return;
  const Mark mark = waiting_.front().mark.get();
  life_ = mark ? mark->life : 0;
  has_begun_again_ = is_closed_ = false;
  opening_ =
      std::async(std::launch::async, [folder = journal_->folder(), run = host_.params.mapper] {
        return std::make_unique<Refusion>(folder, run);
      });
}

void CorrectStep::begin() {
  catch_up_ = CatchUp();
  opening_ = std::async(std::launch::async, [refusion = std::move(refusion_)]() mutable {
    refusion->begin();
    return std::move(refusion);
  });
}

void CorrectStep::takeOpened() {
  if (!isReady(opening_)) return;
  const bool in_vain = std::exchange(discard_opened_log_, false);
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
void CorrectStep::join() {
  while (!is_closed_ && isMarked()) {
    Pending& next = waiting_.front();
    const Mark mark = next.mark.get();
    if (mark && mark->life > life_) throw std::runtime_error(gapOf(journal_->report()));
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
bool CorrectStep::joins(Pending& next) {
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
bool CorrectStep::hasCaughtUp() {
  std::future<Mark> mark = journal_->mark();
  if (mark.wait_for(kLogWait) != std::future_status::ready) return false;
  return numberOf(mark.get()) == refusion_->nextNumber();
}

/// Of a mark in the log that is open: one that has begun anew since counts anew.
uint64_t CorrectStep::numberOf(const Mark& mark) const {
  if (mark && mark->life == life_) return mark->number;
  throw std::runtime_error(gapOf(journal_->report()));
}

/// The map takes the place of the live one.
void CorrectStep::finish() {
  std::map<PackedKey, BlockMesh> mesh = refusion_->takeMesh();
  std::unique_ptr<Mapper> before =
      host_.map.replaceCorrected(refusion_->takeMapper(), std::move(mesh));
  for (const LogCorrection& correction : refusion_->corrections()) journal_->corrected(correction);
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
  freeLater(std::move(before));
  noteProgress();
}

template <class Object>
void CorrectStep::freeLater(std::unique_ptr<Object> object) {
  freeing_.erase(std::remove_if(freeing_.begin(), freeing_.end(), isReady<std::future<void>>),
                 freeing_.end());
  freeing_.push_back(
      std::async(std::launch::async, [object = std::move(object)]() mutable { object.reset(); }));
}

/// What the log no longer has stays where it is.
void CorrectStep::updateFused() {
  std::vector<StampedPose> fused = refusion_->firstCamera();
  const double from_s = fused.front().stamp_s - PoseCorrection::kSameStamp_s;
  const auto logged = std::find_if(fused_.begin(), fused_.end(),
                                   [&](const StampedPose& pose) { return pose.stamp_s >= from_s; });
  fused.insert(fused.begin(), fused_.begin(), logged);
  fused_ = std::move(fused);
}

void CorrectStep::giveUp(const std::string& reason) {
  refuseJoined(reason);
  for (const Pending& pending : waiting_) refuse(pending, reason);
  waiting_.clear();
  if (refusion_) freeLater(std::move(refusion_));
  discard_opened_log_ = opening_.valid();
  fused_.clear();
  has_begun_anew_ = false;
  T_W_S_ = Eigen::Isometry3d::Identity();
  noteProgress();
}

/// Once it is known that the log grows faster, its frames go first.
void CorrectStep::noteFrame() {
  if (!isFusing() || !catch_up_.newFrame()) return;
  ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                        "frames arrive faster than the correction of those before can fuse them "
                        "as well: until it is done, two logged frames are fused for each new one, "
                        "and new ones may be dropped");
}

void CorrectStep::replaced(const Replacement& replacement) {
  if (replacement.kind == Replacement::Kind::kCorrected) return;
  giveUp(replacement.kind == Replacement::Kind::kCleared ? "the map was emptied meanwhile"
                                                         : "another map was loaded meanwhile");
}

std::optional<Rejection> CorrectStep::place(PosedFrame& frame) {
  if (journal_ == nullptr) return std::nullopt;
  noteFrame();
  auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth != nullptr && frame.camera == 0) {
    const StampedPose given{frame.stamp.toSec(), depth->T_W_C};
    if (given_.takesOver(T_W_S_, given)) T_W_S_ = Eigen::Isometry3d::Identity();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (report_.camera_frame != frame.frame_id) report_.camera_frame = frame.frame_id;
  }
  if (T_W_S_.matrix() == Eigen::Isometry3d::Identity().matrix()) return std::nullopt;
  std::visit([&](auto& image) { image.T_W_C = T_W_S_ * image.T_W_C; }, frame.image);
  if (depth != nullptr && depth->keep_center_W) {
    depth->keep_center_W = T_W_S_ * *depth->keep_center_W;
  }
  return std::nullopt;
}

void CorrectStep::fused(const PosedFrame& frame, const IntegrationResult& result) {
  if (journal_ == nullptr || result.status != FrameStatus::kFused) return;
  const auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth == nullptr || frame.camera != 0) return;
  const double stamp_s = frame.stamp.toSec();
  if (!fused_.empty() && stamp_s < fused_.back().stamp_s - GivenMotion::kBegin_s) {
    fused_.clear();
    has_begun_anew_ = true;
  }
  if (fused_.empty() || stamp_s > fused_.back().stamp_s) fused_.push_back({stamp_s, depth->T_W_C});
}

void CorrectStep::answer(const Pending& pending, const std::string& message) {
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

void CorrectStep::refuse(const Pending& pending, const std::string& reason) {
  CorrectionResult result;
  result.message = reason;
  pending.request.answer(result);
  noteRefused(reason);
}

void CorrectStep::noteRefused(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.last = "refused: " + reason;
}

void CorrectStep::refuseJoined(const std::string& reason) {
  for (const Pending& pending : joined_) refuse(pending, reason);
  joined_.clear();
}

void CorrectStep::noteProgress() {
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.fused = refusion_ == nullptr ? 0 : refusion_->fused();
  report_.total = refusion_ == nullptr ? 0 : refusion_->total();
  report_.bytes = refusion_ == nullptr ? 0 : refusion_->bytes();
}

size_t CorrectStep::fusedAgain() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return report_.fused;
}

void CorrectStep::fill(MapStatus& status) {
  if (journal_ == nullptr || host_.params.node.poses.mode != PoseMode::kTf) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  status.correction_fused = report_.fused;
  status.correction_total = report_.total;
  status.last_correction = printableMessage(report_.last);
  const bool on_gpu = status.backend.rfind("cuda", 0) == 0;
  if (report_.bytes > 0) addMemory(status, "correction", placeOf(on_gpu), report_.bytes);
  MapStats stats;
  stats.map_bytes = status.map_bytes;
  stats.max_map_bytes = status.max_map_bytes;
  const std::string obstacle = whyTooLarge(stats);
  if (obstacle.empty() || status.frames_fused == 0) return;
  report(status, MapStatus::OK, MapStatus::NOT_CORRECTABLE,
         "mapping; poses cannot be corrected: " + obstacle);
}

}  // namespace dtsdf
