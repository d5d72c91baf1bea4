/// The step that corrects the poses of images that are in the map: makes the map again beside the
/// live one, from the log, until it can take its place.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "log/corrected_poses.h"
#include "log/refusion.h"
#include "ros/common/pace.h"
#include "ros/common/requests.h"
#include "ros/steps/journal.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Whether logged frames are fused again faster than new ones are added to the log. New frames go
/// first, which leaves the others what time there is. Where that is too little to ever end, two of
/// the log go before each new one.
class CatchUp {
 public:
  /// A new frame is fused. @return whether it is now that the log falls too far behind.
  bool newFrame() {
    work_since_frame_ = 0;
    --lead_;
    const bool begins = !falls_behind_ && lead_ <= -kMostBehind;
    falls_behind_ = falls_behind_ || begins;  // for good, so that it is certain to end
    return begins;
  }

  /// It was the log's turn. @param has_fused Else it has waited for the disk, or ended.
  void turn(bool has_fused) {
    if (has_fused) lead_ = std::min(lead_ + 1, 0);
    work_since_frame_ += has_fused ? 2 : 1;
  }

  /// Whether the log's next turn is before the next new frame.
  bool isLogsTurn() const { return falls_behind_ && work_since_frame_ < kWorkPerFrame; }

 private:
  static constexpr int kMostBehind = 30;  ///< New frames more than those fused again meanwhile.
  static constexpr int kWorkPerFrame =
      4;  ///< Two frames, and time to see that these were the last.

  int lead_ = 0;
  int work_since_frame_ = 0;
  bool falls_behind_ = false;
};

/// What became of a correction.
struct CorrectionResult {
  bool success = false;
  std::string message;          ///< What was done, or why nothing was.
  size_t moved = 0, fused = 0;  ///< Depth images that moved, and those that were fused again.
  double seconds = 0.0;         ///< Since it came.
};

/// With a journal and poses/mode tf: corrected poses, by the service correct_poses and the topic
/// corrected_path.
///
/// A correction first waits until the log holds all frames before it (`waiting_`). Then another
/// thread opens the log and makes the map to begin with (`opening_`), and images are fused again,
/// one with each work(), while frames are fused and logged (`refusion_`). Once that has caught up
/// with the log, its map takes the place of the live one, and the corrections are written to the
/// log.
///
/// One that comes meanwhile joins the one under way. Where images that it moves were fused again
/// already, all are from the first on; but only once, lest those that come every second keep it
/// from ever ending: later ones wait for the end.
class CorrectStep : public Step {
 public:
  struct Request {
    std::vector<StampedPose> poses;  ///< Of the first camera, in W.
    double least = 0.0;  ///< Nothing is done if no image moves as far, in metres or radians.
    std::function<void(const CorrectionResult&)> answer;  ///< Called once; does not throw.
  };

  /// `journal` outlives it; null: there is none, and all is refused.
  CorrectStep(const Host& host, JournalStep* journal);
  ~CorrectStep() override;

  void advertise(const Handles& handles) override;
  std::optional<Rejection> place(PosedFrame& frame) override;
  void fused(const PosedFrame& frame, const IntegrationResult& result) override;
  void replaced(const Replacement& replacement) override;
  void failed() override { giveUp("the map's backend failed"); }
  Work hasWork() const override;
  void work() override;
  void fill(dtsdf_mapping::MapStatus& status) override;

  /// Map's thread: corrects the images that were fused so far.
  void add(Request request);

  /// Frames fused again by the correction under way.
  size_t fusedAgain() const;

 private:
  using Mark = std::optional<LogMark>;
  struct Pending {
    Request request;
    LogCorrection correction;
    std::shared_future<Mark> mark;  ///< Gives `correction.before`.
    SteadyTime came;
    CorrectionEffect effect = {};
  };
  /// How a correction goes.
  struct Report {
    size_t fused = 0, total = 0;  ///< Frames fused again, and all of them; 0 while none are.
    size_t bytes = 0;             ///< Of the map that is made.
    std::string last;             ///< What became of the last one; empty: there was none.
    std::string camera_frame;     ///< Of the first camera's images.
  };

  std::vector<StampedPose> cameraPoses(const GivenPoses& given) const;
  void requireJournal() const;
  void followPath(GivenPoses given);
  void takePath();
  void correctByCall(const GivenPoses& given, CorrectionResult& result);
  bool isForNothing(Request& request) const;
  void leaveOutLost(const PoseCorrection& correction, Request& request) const;
  bool isMarked() const;
  bool isFusing() const { return refusion_ != nullptr && !refusion_->hasToBegin(); }
  void openLog();
  void takeOpened();
  void begin();
  void join();
  void updateFused();
  bool joins(Pending& next);
  void fuseAgain();
  bool hasCaughtUp();
  void finish();
  void giveUp(const std::string& reason);
  void noteFrame();
  uint64_t numberOf(const Mark& mark) const;
  void answer(const Pending& pending, const std::string& message);
  void refuse(const Pending& pending, const std::string& reason);
  void noteRefused(const std::string& reason);
  void refuseJoined(const std::string& reason);
  template <class Object>
  void freeLater(std::unique_ptr<Object> object);
  void noteProgress();

  const Host& host_;
  JournalStep* const journal_;
  std::deque<Pending> waiting_;  ///< In the order that they came in.
  std::future<std::unique_ptr<Refusion>> opening_;
  bool discard_opened_log_ = false;  ///< As the map is another one by now.
  uint64_t life_ = 0;                ///< Of the log, when it was opened.
  std::unique_ptr<Refusion> refusion_;
  std::vector<Pending> joined_;                       ///< That `refusion_` is of.
  bool has_begun_again_ = false, is_closed_ = false;  ///< `refusion_`: closed to later ones.
  CatchUp catch_up_;
  std::vector<std::future<void>> freeing_;  ///< Large maps take long to be freed.

  // Of the first camera.
  std::vector<StampedPose> fused_;  ///< Of the newest recording, with rising stamps.
  bool has_begun_anew_ = false;     ///< That is not the first one of the map.
  GivenMotion given_;
  Eigen::Isometry3d T_W_S_ = Eigen::Isometry3d::Identity();  ///< From where frames are given.

  mutable std::mutex mutex_;  ///< Guards what follows.
  Report report_;
  std::optional<GivenPoses> path_;  ///< The newest one that came, until it is looked at.

  ros::Subscriber path_input_;
  ros::ServiceServer server_;
};

}  // namespace dtsdf
