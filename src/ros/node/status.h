/// Publishes the status message and the diagnostics, at a fixed rate of the wall clock.
#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <dtsdf_mapping/MapStatus.h>
#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <string>
#include <utility>

#include "ros/common/pace.h"

namespace dtsdf {

/// When the status goes into the log: once for each trouble that lasts. Who runs the node looks at
/// its terminal, not at its status: what lacks from the start, such as images on the topic that is
/// waited for, would never be seen.
class TroubleLog {
 public:
  /// A status that is not well has to last so long, and is not logged again so soon.
  static constexpr std::chrono::seconds kLasts{5}, kAgain{60};

  /// Of each status; whether it is to be logged as a warning.
  bool update(bool is_well, uint8_t code, SteadyTime now) {
    const uint8_t trouble = is_well ? uint8_t{0} : code;
    if (std::exchange(trouble_, trouble) != trouble) since_ = now;
    const bool was_logged = logged_since_ == since_;
    if (is_well || was_logged || now - since_ < kLasts) return false;
    if (code == logged_ && now - logged_at_ < kAgain) return false;
    logged_since_ = since_;
    logged_at_ = now;
    logged_ = code;
    return true;
  }

 private:
  SteadyTime since_, logged_since_, logged_at_;
  uint8_t trouble_ = 0, logged_ = 0;
};

class StatusPublisher {
 public:
  /// `fill` writes the status, but for its header; it is called by the queue of the node handles.
  StatusPublisher(const ros::NodeHandle& nh, ros::NodeHandle private_nh, std::string map_frame,
                  double rate_hz, std::function<void(dtsdf_mapping::MapStatus&)> fill);

  void setRate(double rate_hz) { timer_.setPeriod(ros::WallDuration(1.0 / rate_hz)); }

 private:
  void publish();

  const std::string map_frame_;
  const std::function<void(dtsdf_mapping::MapStatus&)> fill_;
  dtsdf_mapping::MapStatus status_;
  TroubleLog trouble_log_;
  diagnostic_updater::Updater updater_;
  ros::Publisher publisher_;
  ros::WallTimer timer_;
};

}  // namespace dtsdf
