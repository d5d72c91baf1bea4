/// Publishes the status message and the diagnostics, at a fixed rate of the wall clock.
#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <dtsdf_mapping/MapStatus.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>

#include "ros/output/status_history.h"
#include "ros/output/status_report.h"

namespace dtsdf {

class StatusPublisher {
 public:
  struct Options {
    std::string map_frame;
    double rate_hz = 1.0;
  };

  /// `collect` is called by the queue of the node handles.
  StatusPublisher(const ros::NodeHandle& nh, ros::NodeHandle private_nh, const Options& options,
                  std::function<StatusInput()> collect);

  void setRate(double rate_hz) { timer_.setPeriod(ros::WallDuration(1.0 / rate_hz)); }

 private:
  void publish();
  static void hintAtColour(const CameraReport& camera);
  void fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper& diagnostics) const;

  Options options_;
  std::function<StatusInput()> collect_;
  dtsdf_mapping::MapStatus status_;
  RunClock run_clock_;
  RecentDrops recent_drops_;
  TroubleLog trouble_log_;
  ColourHint colour_hint_;
  diagnostic_updater::Updater updater_;
  ros::Publisher publisher_;
  ros::WallTimer timer_;
};

}  // namespace dtsdf
