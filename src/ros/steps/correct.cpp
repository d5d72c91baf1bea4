#include "ros/steps/correct.h"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>
#include <variant>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {
namespace {

/// For the last records to be in the file, before the maps are swapped.
constexpr std::chrono::milliseconds kJournalWait{20};

template <class Value>
bool isReady(const Value& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

const char kOnlyByTf[] = "frames can be moved only where poses/mode is tf";
/// How often who waits for a correction looks whether the node ends.
constexpr std::chrono::milliseconds kLookForTheEnd(100);

const char kNothingMoves[] = "no frame moves";
const char kReplaced[] = "a newer correction has taken its place before it began";

double secondsSince(SteadyTime time) { return toSeconds(std::chrono::steady_clock::now() - time); }

std::string describe(const CorrectionEffect& effect) {
  return formatted("%zu frames moved, by up to %g m and %g rad", effect.moved, effect.farthest_m,
                   effect.farthest_rad);
}

/// @throws std::runtime_error where the journal lacks frames of the map
void requireWhole(const std::string& problem) {
  if (problem.empty()) return;
  throw std::runtime_error("the journal lacks frames of the map: " + problem +
                           "; clear_map begins a new one");
}

}  // namespace

CorrectStep::CorrectStep(const Host& host, JournalWriter* journal)
    : host_(host), journal_(journal) {}

CorrectStep::~CorrectStep() { giveUp("the node ends"); }

void CorrectStep::advertise(const Handles& handles) {
  using dtsdf_mapping::CorrectPoses;
  server_ = serve<CorrectPoses>(
      handles.waiting, "correct_poses", [this](const auto& request, auto& response) {
        const std::string path = resolveOutputPath(host_.params.node.output_directory,
                                                   request.file_name, {".txt", ".tum"}, true);
        const Trajectory poses = readTrajectory(path, "give a TUM file");
        correctByCall({poses.poses(), request.frame_id, request.child_frame}, response);
      });
  if (journal_ == nullptr) return;
  if (host_.params.node.poses.mode != PoseMode::kTf) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", "corrected_path is not subscribed: " << kOnlyByTf);
    return;
  }
  const std::string& ns = handles.prompt.getNamespace();
  const boost::function<void(const nav_msgs::Path::ConstPtr&)> callback =
      [this](const nav_msgs::Path::ConstPtr& path) {
        guarded("corrected_path", [&] { followPath(*path); });
      };
  // Of several that wait only the newest counts.
  ros::NodeHandle nh = handles.input;
  path_input_ =
      nh.subscribe<nav_msgs::Path>(ns.substr(0, ns.rfind('/')) + "/corrected_path", 1, callback);
}

/// Input's thread. A path that was not read yet is replaced.
void CorrectStep::followPath(const nav_msgs::Path& path) try {
  GivenPoses given = readPath(path, host_.params.node.corrections.path_frame);
  if (given.poses.empty()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    path_ = std::move(given);
  }
  host_.map_loop.wake();
} catch (const std::exception& error) {
  noteRefused(errorText(error));
}

void CorrectStep::requireJournal() const {
  if (host_.params.node.poses.mode != PoseMode::kTf) throw std::runtime_error(kOnlyByTf);
  if (journal_ != nullptr) return;
  throw std::runtime_error(
      "frames can be moved only if they are in a journal; start the node with journal/folder");
}

/// In the map, of the camera. A frame that is not named is the map frame, level or not.
std::vector<StampedPose> CorrectStep::cameraPoses(const GivenPoses& given) const {
  const Eigen::Isometry3d T_W_F =
      host_.frame.find(given.frame_id.empty() ? host_.params.node.map_frame : given.frame_id);
  Eigen::Isometry3d T_B_C = Eigen::Isometry3d::Identity();
  if (!given.child_frame.empty()) {
    std::string camera;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      camera = camera_frame_;
    }
    if (camera.empty()) throw std::runtime_error("no frame has been received yet");
    const PoseAnswer mount = host_.transforms.find(given.child_frame, camera, ros::Time(0));
    if (!mount.T_W_C) throw std::runtime_error(mount.text);
    T_B_C = *mount.T_W_C;
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
  Request request;
  request.correction.poses = cameraPoses(given);
  request.answer = [done](const CorrectionResult& outcome) { done->set_value(outcome); };
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
    } else if (!result.success && result.message != kReplaced) {
      ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping",
                                     "corrected_path is refused: " << result.message);
    }
  };
  try {
    Request request;
    request.correction.poses = cameraPoses(*given);
    request.least = host_.params.node.corrections.least_m;
    request.answer = answer;
    add(std::move(request));
  } catch (const std::exception& error) {
    noteRefused(errorText(error));
  }
}

/// Only poses of images are kept; a SLAM may say every second that nothing has changed.
void CorrectStep::add(Request request) {
  host_.map.throwIfFailed();
  try {
    requireWhole(journal_->report().problem);
    if (fused_.empty()) {
      throw std::runtime_error("no frame has been fused since the start, clear_map or load_map");
    }
    const PoseCorrection correction(std::move(request.correction.poses), fused_);
    if (!current_ && correction.farthest() < request.least) return answer(request, kNothingMoves);
    const MapStats stats = host_.map.mapper().stats();
    const std::string problem = whyTooLarge(stats.map_bytes, stats.map_bytes, stats.max_map_bytes);
    if (!problem.empty()) throw std::runtime_error(problem);
    request.correction = {journal_->count(), correction.used()};
  } catch (const std::exception& error) {
    return refuse(request, errorText(error));
  }
  refuse(waiting_, kReplaced);
  waiting_ = std::move(request);
  noteProgress();
}

/// What is done by another thread takes no time of this one, so it goes before frames.
Step::Work CorrectStep::hasWork() const {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (path_) return Work::kBeforeFrames;
  }
  if (refusion_) return catch_up_.isJournalsTurn() ? Work::kBeforeFrames : Work::kWhenIdle;
  return (opening_.valid() ? isReady(opening_) : waiting_.has_value()) ? Work::kBeforeFrames
                                                                       : Work::kNone;
}

void CorrectStep::work() {
  takePath();
  try {
    if (refusion_) return fuseAgain();
    if (isReady(opening_)) return takeOpened();
    if (!opening_.valid() && waiting_) return open();
  } catch (const std::exception& error) {
    refuse(current_, errorText(error));
    endCurrent();
  }
}

void CorrectStep::open() {
  current_ = std::exchange(waiting_, std::nullopt);
  opening_ =
      std::async(std::launch::async,
                 [written = journal_->written(), path = journal_->path(), run = host_.params.mapper,
                  correction = current_->correction]() mutable -> std::unique_ptr<Refusion> {
                   if (!written.get()) return nullptr;
                   return std::make_unique<Refusion>(path, run, std::move(correction));
                 });
}

/// In vain where the map is another one by now.
void CorrectStep::takeOpened() {
  refusion_ = opening_.get();
  if (!current_) return endCurrent();
  requireWhole(journal_->report().problem);
  if (!refusion_) throw std::runtime_error("the journal cannot be written");
  const CorrectionEffect& effect = refusion_->effect();
  if (effect.moved == 0 || std::max(effect.farthest_m, effect.farthest_rad) < current_->least) {
    answer(*current_, kNothingMoves);
    return endCurrent();
  }
  catch_up_ = CatchUp();
  noteProgress();
}

void CorrectStep::fuseAgain() {
  const bool has_fused = refusion_->step(host_.map.mapBytes());
  catch_up_.turn(has_fused);
  if (!has_fused && hasCaughtUp()) return finish();
  noteProgress();
}

/// While it waits, nothing is added to the journal.
bool CorrectStep::hasCaughtUp() {
  std::future<bool> written = journal_->written();
  if (written.wait_for(kJournalWait) != std::future_status::ready) return false;
  if (!written.get()) requireWhole(journal_->report().problem);
  return journal_->count() == refusion_->count();
}

/// The map takes the place of the live one.
void CorrectStep::finish() {
  const auto& mesh = refusion_->takeMesh();
  std::unique_ptr<Mapper> before = host_.map.replaceCorrected(refusion_->takeMapper(), mesh);
  journal_->add(refusion_->correction());
  T_W_S_ = refusion_->motion() * T_W_S_;
  fused_ = refusion_->firstCamera();
  answer(*current_,
         describe(refusion_->effect()) +
             formatted("; %zu fused again in %g s", refusion_->fused(),
                       std::round(100.0 * secondsSince(current_->came)) / 100.0),
         refusion_->effect(), refusion_->fused());
  endCurrent();
  freeLater(std::move(before));
}

void CorrectStep::endCurrent() {
  current_.reset();
  if (refusion_) freeLater(std::move(refusion_));
  noteProgress();
}

template <class Object>
void CorrectStep::freeLater(std::unique_ptr<Object> object) {
  freeing_.erase(std::remove_if(freeing_.begin(), freeing_.end(), isReady<std::future<void>>),
                 freeing_.end());
  freeing_.push_back(
      std::async(std::launch::async, [object = std::move(object)]() mutable { object.reset(); }));
}

void CorrectStep::giveUp(const std::string& reason) {
  refuse(current_, reason);
  refuse(waiting_, reason);
  waiting_.reset();
  endCurrent();
  fused_.clear();
  T_W_S_ = Eigen::Isometry3d::Identity();
}

/// Once it is known that the journal grows faster, its frames go first.
void CorrectStep::noteFrame() {
  if (!refusion_ || !catch_up_.newFrame()) return;
  ROS_WARN_STREAM_NAMED(
      "dtsdf_mapping",
      "frames arrive faster than the correction of those before can fuse them "
      "as well: until it is done, two frames of the journal are fused for each new one, "
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
    if (camera_frame_ != frame.frame_id) camera_frame_ = frame.frame_id;
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
  if (!journal_->report().problem.empty()) return fused_.clear();  // it bounds them
  if (!fused_.empty() && stamp_s < fused_.back().stamp_s - GivenMotion::kBegin_s) fused_.clear();
  if (fused_.empty() || stamp_s > fused_.back().stamp_s) fused_.push_back({stamp_s, depth->T_W_C});
}

void CorrectStep::answer(const Request& request, const std::string& message,
                         const CorrectionEffect& effect, size_t fused) {
  CorrectionResult result;
  result.success = true;
  result.moved = effect.moved;
  result.fused = fused;
  result.seconds = secondsSince(request.came);
  result.message = message;
  request.answer(result);
  if (result.moved == 0) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = message;
}

void CorrectStep::refuse(const std::optional<Request>& request, const std::string& reason) {
  if (!request) return;
  CorrectionResult result;
  result.message = reason;
  request->answer(result);
  if (reason != kReplaced) noteRefused(reason);
}

void CorrectStep::noteRefused(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = "refused: " + reason;
}

void CorrectStep::noteProgress() {
  const std::lock_guard<std::mutex> lock(mutex_);
  fused_again_ = refusion_ == nullptr ? 0 : refusion_->fused();
  to_fuse_ = refusion_ == nullptr ? 0 : refusion_->total();
  bytes_ = refusion_ == nullptr ? 0 : refusion_->bytes();
}

void CorrectStep::fill(MapStatus& status) {
  if (journal_ == nullptr || host_.params.node.poses.mode != PoseMode::kTf) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  status.correction_fused = fused_again_;
  status.correction_total = to_fuse_;
  status.last_correction = printableMessage(last_);
  const bool on_gpu = status.backend.rfind("cuda", 0) == 0;
  if (bytes_ > 0) addMemory(status, "correction", on_gpu ? kGpu : kHost, bytes_);
  const std::string obstacle =
      whyTooLarge(status.map_bytes, status.map_bytes, status.max_map_bytes);
  if (obstacle.empty() || status.frames_fused == 0) return;
  report(status, MapStatus::OK, MapStatus::NOT_CORRECTABLE,
         "mapping; poses cannot be corrected: " + obstacle);
}

}  // namespace dtsdf
