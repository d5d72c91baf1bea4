/// Since when frames could have come: what is silent in a pause is no fault.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <optional>

#include "ros/common/steady_clock.h"

namespace dtsdf {

/// Updated at each status; wall time. While mapping is paused or simulated time stands still,
/// nothing is expected to come, and afterwards the waiting begins anew.
class RunClock {
 public:
  struct Moment {
    SteadyTime at;
    ros::Time now;  ///< ROS's clock.
    bool paused = false;
  };

  void update(const Moment& moment) {
    if (!begun_ || moment.now != now_) changed_at_ = moment.at;
    now_ = moment.now;
    // Simulated time comes in steps: that of a slow simulator is not at a stand at once.
    stands_ = moment.at - changed_at_ >= std::chrono::seconds(1);
    if (!begun_ || moment.paused || stands_) begun_ = moment.at;
    ran_s_ = std::chrono::duration<double>(moment.at - *begun_).count();
  }

  /// How long there was neither a pause nor a stand of time.
  double ran_s() const { return ran_s_; }
  bool timeStands() const { return stands_; }

 private:
  std::optional<SteadyTime> begun_;
  SteadyTime changed_at_{};
  ros::Time now_;
  bool stands_ = false;
  double ran_s_ = 0.0;
};

}  // namespace dtsdf
