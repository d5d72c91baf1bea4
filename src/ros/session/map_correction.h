/// Corrects the poses of images that are in the map: makes the map anew beside the live one, from
/// the log, until it can take its place.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "log/corrected_poses.h"
#include "log/refusion.h"
#include "ros/common/schedule.h"
#include "ros/common/worker_thread.h"
#include "ros/input/frame_queue.h"
#include "ros/output/reports.h"
#include "ros/session/map_log.h"

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

/// A correction first waits until the log holds all frames before it (`waiting_`). Then another
/// thread opens the log and makes the map to begin with (`opening_`), and images are fused again,
/// one with each step(), while frames go on to be fused and logged (`refusion_`). Once that has
/// caught up with the log, step() hands out the map, and finish() writes the corrections to the
/// log.
///
/// One that comes meanwhile joins the one under way. Where images that it moves were fused again
/// already, all are from the first on; but only once, lest those that come every second keep it
/// from ever ending: later ones wait for the end.
///
/// Map's thread only, but for report() and noteRefused().
class MapCorrection {
 public:
  struct Request {
    std::vector<StampedPose> poses;  ///< Of the first camera, in W.
    double least = 0.0;  ///< Nothing is done if no image moves as far, in metres or radians.
    std::function<void(const CorrectionResult&)> answer;  ///< Called once; does not throw.
  };

  /// `log` outlives it. @param run Where mappers run.
  MapCorrection(MapLog& log, const MapperParams& run) : log_(log), run_(run) {}
  ~MapCorrection() { giveUp("the node ends"); }

  /// Corrects the images that were fused so far. `live` is the map as it is.
  void add(Request request, const MapStats& live);

  /// Whether step() would do something.
  bool hasWork() const;
  /// Whether it should before the next frame is fused: what is done by another thread takes no time
  /// of this one; and see CatchUp.
  bool goesFirst() const { return !isFusing() || catch_up_.isLogsTurn(); }

  /// The map that takes the place of the live one, and its whole mesh.
  struct Corrected {
    std::unique_ptr<Mapper> mapper;
    std::map<PackedKey, BlockMesh> mesh;
  };
  /// Does a little. Never throws: what fails is answered.
  std::optional<Corrected> step(const MapStats& live);

  /// The map has taken its place; `replaced` is the one that was there, to be freed.
  void finish(std::unique_ptr<Mapper> replaced);

  /// Answers all with the reason: the map is another one. Frames are where they are given again.
  void giveUp(const std::string& reason);

  /// Brings a frame to where the last correction has put those before it, until the source of poses
  /// has taken that over.
  void place(PosedFrame& frame);

  /// It is in the map, and in the log.
  void wasFused(const PosedFrame& frame);

  // Any thread.
  CorrectionReport report() const;
  /// One that cannot be added was refused, for this reason.
  void noteRefused(const std::string& reason);

 private:
  using Mark = std::optional<LogMark>;
  struct Pending {
    Request request;
    LogCorrection correction;
    std::shared_future<Mark> mark;  ///< Gives `correction.before`.
    SteadyTime came;
    CorrectionEffect effect = {};
  };

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
  std::optional<Corrected> fuseAgain(const MapStats& live);
  bool hasCaughtUp();
  void noteFrame();
  uint64_t numberOf(const Mark& mark) const;
  void answer(const Pending& pending, const std::string& message);
  void refuse(const Pending& pending, const std::string& reason);
  void refuseJoined(const std::string& reason);
  template <class Object>
  void freeLater(std::unique_ptr<Object> object);
  void noteProgress();

  MapLog& log_;
  const MapperParams run_;
  std::deque<Pending> waiting_;  ///< In the order that they came in.
  std::future<std::unique_ptr<Refusion>> opening_;
  bool is_opening_in_vain_ = false;  ///< As the map is another one by now.
  uint64_t life_ = 0;                ///< Of the log, when it was opened.
  std::unique_ptr<Refusion> refusion_;
  std::vector<Pending> joined_;                       ///< That `refusion_` is of.
  bool has_begun_again_ = false, is_closed_ = false;  ///< `refusion_`: closed to later ones.
  CatchUp catch_up_;

  // Of the first camera.
  std::vector<StampedPose> fused_;  ///< Of the newest recording, with rising stamps.
  bool has_begun_anew_ = false;     ///< That is not the first one of the map.
  GivenMotion given_;
  Eigen::Isometry3d T_W_S_ = Eigen::Isometry3d::Identity();  ///< From where frames are given.

  mutable std::mutex mutex_;
  CorrectionReport report_;

  WorkerThread helper_{[] { return std::chrono::hours(1); }};  ///< For what takes long.
};

}  // namespace dtsdf
