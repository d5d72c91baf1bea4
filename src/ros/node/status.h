/// Publishes the status message and the diagnostics, at publish/status_rate_hz in wall time.
#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <dtsdf_mapping/MapStatus.h>
#include <ros/console.h>
#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <string>
#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/common/pace.h"
#include "ros/common/status_fields.h"

namespace dtsdf {

class StatusPublisher {
 public:
  /// `fill` writes all fields of the status except the header. It is called on the callback queue
  /// of the node handles.
  StatusPublisher(const ros::NodeHandle& nh, ros::NodeHandle private_nh, std::string map_frame,
                  double rate_hz, std::function<void(MapStatus&)> fill)
      : map_frame_(std::move(map_frame)),
        fill_(std::move(fill)),
        updater_(nh, private_nh, private_nh.getNamespace()) {
    updater_.setHardwareID("none");
    updater_.add("mapping", [this](diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
      diagnostics.summary(status_.level, status_.message);
      diagnostics.add("backend", status_.backend);
      diagnostics.add("images_received", status_.images_received);
      diagnostics.add("frames_fused", status_.frames_fused);
      diagnostics.add("frames_dropped", status_.frames_dropped);
      for (const auto& of : status_.dropped) diagnostics.add("dropped/" + of.reason, of.count);
      diagnostics.add("map_bytes", status_.map_bytes);
    });
    // Latched, so that new subscribers get the last status immediately.
    publisher_ = private_nh.advertise<MapStatus>("status", 1, true);
    publish();  // before the timer starts, because another thread may serve it
    timer_ = private_nh.createWallTimer(
        ros::WallDuration(1.0 / rate_hz),
        [this](const ros::WallTimerEvent&) { guarded("status", [this] { publish(); }); });
  }

  void setRate(double rate_hz) { timer_.setPeriod(ros::WallDuration(1.0 / rate_hz)); }

 private:
  void publish() {
    MapStatus status;
    fill_(status);
    status.header.frame_id = map_frame_;
    status.header.stamp = ros::Time::now();
    if (status.level == MapStatus::OK || status.code != status_.code) {
      problem_since_ = std::chrono::steady_clock::now();
      is_logged_ = false;
    }
    status_ = std::move(status);
    publisher_.publish(status_);
    logProblem();
    // The updater's own timer would wait for simulated time.
    updater_.force_update();
  }

  /// Logs each problem once, after 5 s, for users who watch the terminal and not the status.
  void logProblem() {
    constexpr std::chrono::seconds kProblemDelay{5};
    if (is_logged_ || std::chrono::steady_clock::now() - problem_since_ < kProblemDelay) return;
    is_logged_ = true;
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", status_.message);
  }

  const std::string map_frame_;
  const std::function<void(MapStatus&)> fill_;
  MapStatus status_;
  SteadyTime problem_since_;
  bool is_logged_ = false;  ///< Whether the current problem has been logged.
  diagnostic_updater::Updater updater_;
  ros::Publisher publisher_;
  ros::WallTimer timer_;
};

}  // namespace dtsdf
