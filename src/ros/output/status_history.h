/// What a status needs of those before it: how long the node has run, which drops are recent, and
/// what has been said already.
#pragma once

#include <ros/time.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "ros/common/schedule.h"
#include "ros/input/frame_accounting.h"

namespace dtsdf {

/// Since when frames could have come: what is silent in a pause is no fault. Updated at each
/// status; wall time. While mapping is paused or simulated time stands still, nothing is expected
/// to come, and afterwards the waiting begins anew.
class RunClock {
 public:
  struct Moment {
    SteadyTime at;
    ros::Time now;  ///< ROS's clock.
    bool paused = false;
  };

  void update(const Moment& moment) {
    if (!has_begun_ || moment.now != now_) changed_at_ = moment.at;
    now_ = moment.now;
    // Simulated time comes in steps: that of a slow simulator is not at a stand at once.
    stands_ = moment.at - changed_at_ >= std::chrono::seconds(1);
    if (!has_begun_ || moment.paused || stands_) begun_ = moment.at;
    has_begun_ = true;
    ran_s_ = std::chrono::duration<double>(moment.at - begun_).count();
  }

  /// How long there was neither a pause nor a stand of time.
  double ran_s() const { return ran_s_; }
  bool timeStands() const { return stands_; }

 private:
  bool has_begun_ = false;
  SteadyTime begun_{}, changed_at_{};
  ros::Time now_;
  bool stands_ = false;
  double ran_s_ = 0.0;
};

/// Of one camera's depth, within the last while.
struct DropShare {
  uint64_t received = 0;
  uint64_t dropped = 0;  ///< For reasons that are a fault: not as mapping is paused.
  DropReason most_common = DropReason::kQueueFull;
};

/// How many depth images were dropped lately, and why. Updated at each status.
class RecentDrops {
 public:
  /// Of each camera, in their order.
  std::vector<DropShare> update(const std::vector<CameraReport>& cameras, SteadyTime now);

 private:
  struct Moment {
    SteadyTime at;
    std::vector<FrameCounts> frames;
  };

  std::deque<Moment> moments_;
};

/// What to do against drops for a reason; empty where the text of the last drop has to do.
const char* remedyFor(DropReason reason);

/// When the status goes into the log: once for each trouble that lasts. Who runs the node looks at
/// its terminal, not at its status: what lacks from the start, such as images on the topic that is
/// waited for, would never be seen.
class TroubleLog {
 public:
  /// A status that is not well has to last so long, and is not logged again so soon.
  static constexpr std::chrono::seconds kLasts{5}, kAgain{60};

  /// Of each status; whether it is to be logged as a warning.
  bool update(bool is_well, const std::string& message, SteadyTime now) {
    if (is_well) {
      since_.reset();
      return false;
    }
    const std::string kind = kindOf(message);
    if (!since_ || kind != kind_) {
      since_ = now;
      kind_ = kind;
    }
    if (now - *since_ < kLasts) return false;
    const bool is_known = logged_at_ && kind == logged_kind_;
    if (is_known && (is_logged_ == since_ || now - *logged_at_ < kAgain)) return false;
    logged_at_ = now;
    logged_kind_ = kind;
    is_logged_ = since_;
    return true;
  }

 private:
  /// Without the names and numbers, which change.
  static std::string kindOf(const std::string& message) {
    return message.substr(0, message.find_first_of("'0123456789"));
  }

  std::optional<SteadyTime> since_, logged_at_;
  std::optional<SteadyTime> is_logged_;  ///< Since when the trouble was that was logged last.
  std::string kind_, logged_kind_;
};

/// Says once that colour is published, but not on the topic that is waited for. Most depth cameras
/// come without colour, so a map without is no trouble; but who set a wrong topic would never learn
/// why the mesh is grey.
class ColourHint {
 public:
  /// Colour may start later than depth.
  static constexpr std::chrono::seconds kPatience{10};

  /// Of each status; the camera whose colour is worth a look, at most once.
  const CameraReport* update(const std::vector<CameraReport>& cameras, SteadyTime now) {
    if (is_done_) return nullptr;
    const auto place = std::find_if(cameras.begin(), cameras.end(), lacksColour);
    if (place == cameras.end()) {
      lacks_ = false;
      return nullptr;
    }
    if (!lacks_) since_ = now;
    lacks_ = true;
    if (now - since_ < kPatience) return nullptr;
    is_done_ = true;
    return &*place;
  }

 private:
  /// Colour that has to be there is a matter of the status.
  static bool lacksColour(const CameraReport& camera) {
    return camera.depth.frames.fused > 0 && camera.colour && !camera.is_colour_needed &&
           camera.colour->frames.images == 0 && camera.colour->image_publishers == 0;
  }

  bool lacks_ = false, is_done_ = false;
  SteadyTime since_{};
};

}  // namespace dtsdf
