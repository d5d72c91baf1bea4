/// The step that corrects the poses of images that are in the map: makes the map again beside the
/// live one, from the journal, until it can take its place.
#pragma once

#include <dtsdf_mapping/CorrectPoses.h>

#include <algorithm>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "journal/refusion.h"
#include "journal/writer.h"
#include "ros/common/pace.h"
#include "ros/common/requests.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Whether frames of the journal are fused again faster than new ones are added to it. New frames
/// go first, which leaves the others what time there is. Where that is too little to ever end, two
/// of the journal go before each new one.
class CatchUp {
 public:
  /// A new frame is fused. @return whether it is now that the journal falls too far behind.
  bool newFrame() {
    work_since_frame_ = 0;
    --lead_;
    const bool begins = !falls_behind_ && lead_ <= -kMostBehind;
    falls_behind_ = falls_behind_ || begins;  // for good, so that it is certain to end
    return begins;
  }

  /// It was the journal's turn. @param has_fused Else it has waited for the disk, or ended.
  void turn(bool has_fused) {
    if (has_fused) lead_ = std::min(lead_ + 1, 0);
    work_since_frame_ += has_fused ? 2 : 1;
  }

  /// Whether the journal's next turn is before the next new frame.
  bool isJournalsTurn() const { return falls_behind_ && work_since_frame_ < kWorkPerFrame; }

 private:
  static constexpr int kMostBehind = 30;  ///< New frames more than those fused again meanwhile.
  static constexpr int kWorkPerFrame =
      4;  ///< Two frames, and time to see that these were the last.

  int lead_ = 0;
  int work_since_frame_ = 0;
  bool falls_behind_ = false;
};

/// What became of a correction.
using CorrectionResult = dtsdf_mapping::CorrectPoses::Response;

/// With a journal and poses/mode tf: corrected poses, by the service correct_poses and the topic
/// corrected_path.
///
/// One is under way at a time. A thread waits until the journal holds all frames before it, opens
/// it and makes the map to begin with (`opening_`); then records are done again, one with each
/// work(), while frames are fused and written (`refusion_`). Once that has caught up with the
/// journal, its map takes the place of the live one, and the correction is written to the journal.
///
/// What comes meanwhile waits; a newer one takes the place of the one that waits.
class CorrectStep : public Step {
 public:
  struct Request {
    journal::Correction
        correction;      ///< Of the first camera, in W; once looked at, of images alone.
    double least = 0.0;  ///< Nothing is done if no image moves as far, in metres or radians.
    std::function<void(const CorrectionResult&)> answer;  ///< Called once; does not throw.
    SteadyTime came = std::chrono::steady_clock::now();
  };

  /// `journal` outlives it; null: there is none, and all is refused.
  CorrectStep(const Host& host, JournalWriter* journal);
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

 private:
  std::vector<StampedPose> cameraPoses(const GivenPoses& given) const;
  void requireJournal() const;
  void followPath(const nav_msgs::Path& path);
  void takePath();
  void correctByCall(const GivenPoses& given, CorrectionResult& result);
  void open();
  void takeOpened();
  bool hasCaughtUp();
  void fuseAgain();
  void finish();
  void giveUp(const std::string& reason);
  void endCurrent();
  void noteFrame();
  void answer(const Request& request, const std::string& message,
              const CorrectionEffect& effect = {}, size_t fused = 0);
  void refuse(const std::optional<Request>& request, const std::string& reason);
  void noteRefused(const std::string& reason);
  template <class Object>
  void freeLater(std::unique_ptr<Object> object);
  void noteProgress();

  const Host& host_;
  JournalWriter* const journal_;
  std::optional<Request> waiting_, current_;
  std::future<std::unique_ptr<Refusion>> opening_;  ///< Of `current_`, and then
  std::unique_ptr<Refusion> refusion_;
  CatchUp catch_up_;
  std::vector<std::future<void>> freeing_;  ///< Large maps take long to be freed.

  // Of the first camera.
  std::vector<StampedPose> fused_;  ///< Of the newest recording, with rising stamps.
  GivenMotion given_;
  Eigen::Isometry3d T_W_S_ = Eigen::Isometry3d::Identity();  ///< From where frames are given.

  mutable std::mutex mutex_;              ///< Guards what follows.
  size_t fused_again_ = 0, to_fuse_ = 0;  ///< Frames, and all of them; 0 while none are.
  size_t bytes_ = 0;                      ///< Of the map that is made.
  std::string last_;                      ///< What became of the last one; empty: there was none.
  std::string camera_frame_;              ///< Of the first camera's images.
  std::optional<GivenPoses> path_;        ///< The newest one that came, until it is read.

  ros::Subscriber path_input_;
  ros::ServiceServer server_;
};

}  // namespace dtsdf
