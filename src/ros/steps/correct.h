/// The step that corrects the poses of images in the map: builds a second map from the journal,
/// then replaces the live one with it.
#pragma once

#include <dtsdf_mapping/CorrectPoses.h>
#include <nav_msgs/Path.h>
#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "journal/refusion.h"
#include "journal/writer.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Outcome of a correction.
using CorrectionResult = dtsdf_mapping::CorrectPoses::Response;

/// Takes corrected poses from the service correct_poses and the topic corrected_path. Needs a
/// journal and poses/mode tf.
///
/// One correction runs at a time. First, a background thread (`opening_`) waits until the journal
/// holds all earlier frames, opens it and builds the initial map. Then each call to work() replays
/// one record (`refusion_`), while new frames are fused into the live map and written to the
/// journal. Once the replay has caught up with the journal, its map replaces the live one, and the
/// correction is written to the journal.
///
/// A correction that arrives while another one runs has to wait. A newer correction replaces a
/// waiting one.
class CorrectStep : public Step {
 public:
  struct Request {
    /// Poses of the first camera in W; after add(), only those that belong to images.
    journal::Correction correction;
    double min_move = 0.0;  ///< If no image moves this far, in metres or radians, nothing is done.
    /// Called once, unless it is empty; must not throw.
    std::function<void(const CorrectionResult&)> answer = nullptr;
    SteadyTime came = std::chrono::steady_clock::now();
  };

  /// `journal` must outlive the step; if null, all corrections are refused.
  CorrectStep(const Host& host, JournalWriter* journal)
      : host_(host), journal_(journal), has_tf_poses_(host.params.poses.mode == PoseMode::kTf) {}
  ~CorrectStep() override { giveUp("the node is shutting down"); }

  void advertise(const Handles& handles) override {
    using dtsdf_mapping::CorrectPoses;
    server_ = serve<CorrectPoses>(
        handles.waiting, "correct_poses", [this](const auto& request, auto& response) {
          const std::string path = resolveOutputPath(host_.params.output_directory,
                                                     request.file_name, {".txt", ".tum"}, true);
          const Trajectory poses = readTrajectory(path, "give a TUM file");
          response = correctByCall(poses.poses(), request.frame_id, request.child_frame);
        });
    if (journal_ == nullptr) return;
    if (!has_tf_poses_) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", "corrected_path is ignored: " << kOnlyByTf);
      return;
    }
    const boost::function<void(const nav_msgs::Path::ConstPtr&)> callback =
        [this](const nav_msgs::Path::ConstPtr& path) {
          guarded("corrected_path", [&] { followPath(*path); });
        };
    // The queue holds one message, since only the newest waiting path counts. The callback may wait
    // for the map thread.
    ros::NodeHandle nh = handles.input;
    nh.setCallbackQueue(handles.waiting.getCallbackQueue());
    path_input_ = nh.subscribe<nav_msgs::Path>(handles.ns + "/corrected_path", 1, callback);
  }

  std::optional<Rejection> place(PosedFrame& frame) override {
    if (journal_ == nullptr) return std::nullopt;
    work_since_frame_ = 0;
    auto* const depth = std::get_if<DepthFrame>(&frame.image);
    if (depth != nullptr && frame.camera == 0) {
      const StampedPose given{frame.stamp.toSec(), depth->T_W_C};
      if (given_.adoptsCorrection(T_W_S_, given)) T_W_S_ = Eigen::Isometry3d::Identity();
      const std::lock_guard<std::mutex> lock(mutex_);
      camera_frame_ = frame.frame_id;
    }
    if (T_W_S_.matrix() == Eigen::Isometry3d::Identity().matrix()) return std::nullopt;
    frame.move(T_W_S_);
    if (depth != nullptr && depth->keep_center_W) {
      depth->keep_center_W = T_W_S_ * *depth->keep_center_W;
    }
    return std::nullopt;
  }

  void fused(const PosedFrame& frame, const IntegrationResult& result) override {
    if (journal_ == nullptr || result.status != FrameStatus::kFused) return;
    const auto* const depth = std::get_if<DepthFrame>(&frame.image);
    if (depth == nullptr || frame.camera != 0) return;
    const double stamp_s = frame.stamp.toSec();
    // Once the journal has stopped, no correction is possible, so poses are no longer kept.
    if (!journal_->report().problem.empty()) return fused_.clear();
    if (!fused_.empty() && stamp_s < fused_.back().stamp_s - GivenMotion::kBegin_s) fused_.clear();
    if (fused_.empty() || stamp_s > fused_.back().stamp_s) {
      fused_.push_back({stamp_s, depth->T_W_C});
    }
  }

  void replaced(const MapContents* loaded, const std::shared_ptr<const MapChunks>&) override {
    giveUp(loaded ? "another map has been loaded" : "the map has been emptied");
  }
  void failed() override { giveUp("the map's backend failed"); }

  /// Takes precedence over a waiting frame, but replays at most two records per new frame, which is
  /// enough to catch up.
  bool work(bool frame_waits) override {
    constexpr int kWorkPerFrame = 4;
    try {
      if (refusion_) {
        if (frame_waits && work_since_frame_ >= kWorkPerFrame) return false;
        fuseAgain();
      } else if (opening_.valid()) {
        if (opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
        startRefusion();
      } else if (waiting_) {
        open();
      } else {
        return false;
      }
    } catch (const std::exception& error) {
      answer(current_, false, errorText(error));
      endCurrent();
    }
    updateProgress();
    return true;
  }

  void fill(MapStatus& status) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    status.correction_fused = fused_again_;
    status.correction_total = to_fuse_;
    status.last_correction = printableMessage(last_);
    const bool on_gpu = status.backend.rfind("cuda", 0) == 0;
    if (bytes_ > 0) addMemory(status, "correction", on_gpu ? kGpu : kHost, bytes_);
  }

  /// On the map thread: queues a correction, with the poses that belong to frames fused so far. If
  /// no correction is running, ignores a request that moves no frame by at least `min_move`, since
  /// a SLAM system may publish an unchanged path every second.
  void add(Request request) {
    try {
      host_.map.throwIfFailed();
      requireCompleteJournal();
      if (fused_.empty()) {
        throw std::runtime_error("no frame has been fused since the start, clear_map or load_map");
      }
      const PoseCorrection correction(std::move(request.correction.poses), fused_);
      if (!current_ && correction.farthest() < request.min_move) {
        return answer(request, true, kNothingMoves);
      }
      const MapStats stats = host_.map.mapper().stats();
      const std::string problem =
          whyTooLarge(stats.map_bytes, stats.map_bytes, stats.max_map_bytes);
      if (!problem.empty()) throw std::runtime_error(problem);
      request.correction = {journal_->count(), correction.used()};
    } catch (const std::exception& error) {
      return answer(request, false, errorText(error));
    }
    answer(waiting_, false, kReplaced);
    waiting_ = std::move(request);
  }

 private:
  static constexpr char kOnlyByTf[] = "poses can be corrected only if poses/mode is tf";
  static constexpr char kNothingMoves[] = "nothing to correct: no pose changes";
  static constexpr char kReplaced[] = "a newer correction replaced this one before it began";

  /// Called on a service thread.
  void followPath(const nav_msgs::Path& path) try {
    if (path.header.frame_id.size() > kLongestName) {
      throw std::runtime_error("the path's frame_id is too long");
    }
    if (path.poses.empty()) return;
    std::vector<StampedPose> poses;
    for (const geometry_msgs::PoseStamped& pose : path.poses) {
      poses.push_back({pose.header.stamp.toSec(), readPose(pose.pose)});
    }
    submit({{0, cameraPoses(poses, path.header.frame_id, host_.params.path_frame)},
            host_.params.min_correction_m});
  } catch (const std::exception& error) {
    setOutcome(false, errorText(error));
  }

  /// Waits until the map thread has queued the request.
  void submit(Request request) {
    host_.map_loop.run([&] { add(std::move(request)); }).get();
  }

  /// Waits for the outcome. @throws std::runtime_error if the correction is refused.
  CorrectionResult correctByCall(const std::vector<StampedPose>& poses, const std::string& frame,
                                 const std::string& child_frame) {
    if (!has_tf_poses_) throw std::runtime_error(kOnlyByTf);
    if (journal_ == nullptr) {
      throw std::runtime_error(
          "poses can be corrected only if there is a journal; start the node with journal/folder");
    }
    const auto done = std::make_shared<std::promise<CorrectionResult>>();
    std::future<CorrectionResult> answer = done->get_future();
    submit({{0, cameraPoses(poses, frame, child_frame)},
            0.0,
            [done](const CorrectionResult& outcome) { done->set_value(outcome); }});
    while (answer.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
      if (host_.is_ending) throw std::runtime_error("the node is shutting down");
    }
    CorrectionResult result = answer.get();
    if (!result.success) throw std::runtime_error(result.message);
    return result;
  }

  /// Converts poses of `child_frame` (empty: the camera) in `frame` to poses of the camera in W. An
  /// empty `frame` is map_frame, which is not W if the map is levelled.
  std::vector<StampedPose> cameraPoses(const std::vector<StampedPose>& given,
                                       const std::string& frame,
                                       const std::string& child_frame) const {
    const Eigen::Isometry3d T_W_F =
        host_.frame.find(frame.empty() ? host_.params.map_frame : frame);
    Eigen::Isometry3d T_B_C = Eigen::Isometry3d::Identity();
    if (!child_frame.empty()) {
      std::unique_lock<std::mutex> lock(mutex_);
      const std::string camera = camera_frame_;
      lock.unlock();
      if (camera.empty()) throw std::runtime_error("no frame has been received yet");
      const PoseAnswer mount = host_.transforms.find(child_frame, camera, ros::Time(0));
      if (!mount.T_W_C) throw std::runtime_error(mount.text);
      T_B_C = *mount.T_W_C;
    }
    std::vector<StampedPose> poses;
    poses.reserve(given.size());
    for (const StampedPose& pose : given) {
      poses.push_back({pose.stamp_s, T_W_F * pose.T_W_C * T_B_C});
    }
    return poses;
  }

  /// @throws std::runtime_error if frames of the map are missing from the journal.
  void requireCompleteJournal() const {
    const std::string problem = journal_->report().problem;
    if (problem.empty()) return;
    throw std::runtime_error("frames of the map are missing from the journal: " + problem);
  }

  void open() {
    current_ = std::exchange(waiting_, std::nullopt);
    opening_ =
        std::async(std::launch::async,
                   [written = journal_->written(), journal = journal_, run = host_.params.mapper,
                    correction = current_->correction]() mutable -> std::unique_ptr<Refusion> {
                     if (!written.get()) return nullptr;
                     return std::make_unique<Refusion>(journal->path(), run, std::move(correction));
                   });
  }

  /// Starts the replay, unless the map was replaced in the meantime.
  void startRefusion() {
    refusion_ = opening_.get();
    if (!current_) return endCurrent();
    requireCompleteJournal();
    if (!refusion_) throw std::runtime_error("the journal cannot be written");
    const CorrectionEffect& effect = refusion_->effect();
    if (effect.moved == 0 ||
        std::max(effect.farthest_m, effect.farthest_rad) < current_->min_move) {
      answer(current_, true, kNothingMoves);
      return endCurrent();
    }
    work_since_frame_ = 0;
  }

  void fuseAgain() {
    const bool has_replayed = refusion_->step(host_.map.mapBytes());
    // A step that replayed nothing counts, too, because hasCaughtUp() may wait for the disk.
    work_since_frame_ += has_replayed ? 2 : 1;
    if (!has_replayed && hasCaughtUp()) finish();
  }

  /// Whether every record of the journal has been replayed. Waits briefly for the last records to
  /// reach the file.
  bool hasCaughtUp() {
    std::future<bool> written = journal_->written();
    constexpr std::chrono::milliseconds kJournalWait{20};
    if (written.wait_for(kJournalWait) != std::future_status::ready) return false;
    if (!written.get()) requireCompleteJournal();
    return journal_->count() == refusion_->replay().count();
  }

  /// Replaces the live map with the corrected one.
  void finish() {
    const auto& mesh = refusion_->takeMesh();
    host_.map.replaceCorrected(refusion_->takeMapper(), mesh);
    journal_->add(refusion_->correction());
    T_W_S_ = refusion_->replay().motion() * T_W_S_;
    fused_ = refusion_->replay().firstCamera();
    const CorrectionEffect& effect = refusion_->effect();
    const double took_s = toSeconds(std::chrono::steady_clock::now() - current_->came);
    answer(current_, true,
           formatted("%zu frames moved, by up to %g m and %g rad; %zu fused again in %g s",
                     effect.moved, effect.farthest_m, effect.farthest_rad, refusion_->fused(),
                     std::round(100.0 * took_s) / 100.0),
           effect.moved, refusion_->fused());
    endCurrent();
  }

  void endCurrent() {
    current_.reset();
    refusion_.reset();
  }

  void giveUp(const std::string& reason) {
    answer(current_, false, reason);
    answer(waiting_, false, reason);
    waiting_.reset();
    endCurrent();
    updateProgress();
    fused_.clear();
    T_W_S_ = Eigen::Isometry3d::Identity();
  }

  void answer(const std::optional<Request>& request, bool success, const std::string& message,
              size_t moved = 0, size_t fused = 0) {
    if (!request) return;
    CorrectionResult result;
    result.success = success;
    result.moved = moved;
    result.fused = fused;
    result.seconds = toSeconds(std::chrono::steady_clock::now() - request->came);
    result.message = message;
    if (request->answer) request->answer(result);
    if (message != kNothingMoves && message != kReplaced) setOutcome(success, message);
  }

  void setOutcome(bool success, const std::string& message) {
    const std::string outcome = (success ? "" : "refused: ") + message;
    if (success) {
      ROS_INFO_STREAM_NAMED("dtsdf_mapping", "correction of poses: " << outcome);
    } else {
      ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", "correction of poses " << outcome);
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = outcome;
  }

  void updateProgress() {
    const std::lock_guard<std::mutex> lock(mutex_);
    fused_again_ = refusion_ == nullptr ? 0 : refusion_->fused();
    to_fuse_ = refusion_ == nullptr ? 0 : refusion_->replay().depthImages();
    bytes_ = refusion_ == nullptr ? 0 : refusion_->bytes();
  }

  const Host& host_;
  JournalWriter* const journal_;
  const bool has_tf_poses_;
  std::optional<Request> waiting_, current_;
  std::future<std::unique_ptr<Refusion>> opening_;  ///< Opens the journal for `current_`.
  std::unique_ptr<Refusion> refusion_;
  /// Work since the last frame: 2 per replayed record, 1 per other step.
  int work_since_frame_ = 0;

  /// Poses of the first camera's fused frames, by stamp; cleared if stamps jump back.
  std::vector<StampedPose> fused_;
  GivenMotion given_;  ///< Motion of the first camera.
  /// Transforms the input poses of all cameras to corrected poses; the identity once the source of
  /// the poses has adopted the correction.
  Eigen::Isometry3d T_W_S_ = Eigen::Isometry3d::Identity();

  mutable std::mutex mutex_;              ///< Guards the members below.
  size_t fused_again_ = 0, to_fuse_ = 0;  ///< Number of depth images replayed, and the total.
  size_t bytes_ = 0;                      ///< Size of the second map.
  std::string last_;          ///< Outcome of the last correction; empty if there was none.
  std::string camera_frame_;  ///< Frame of the first camera's images.

  ros::Subscriber path_input_;
  ros::ServiceServer server_;
};

}  // namespace dtsdf
