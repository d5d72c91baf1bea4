#include "ros/output/status_publisher.h"

#include <utility>

#include "ros/common/callback_guard.h"

namespace dtsdf {

using dtsdf_mapping::DropCount;
using dtsdf_mapping::MapStatus;

StatusPublisher::StatusPublisher(ros::NodeHandle nh, ros::NodeHandle private_nh,
                                 const Options& options, std::function<StatusInput()> collect)
    : options_(options),
      collect_(std::move(collect)),
      updater_(nh, private_nh, private_nh.getNamespace()) {
  updater_.setHardwareID("none");
  updater_.add("mapping", [this](diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
    fillDiagnostics(diagnostics);
  });
  // Latched: a tool that asks once gets the answer at once.
  publisher_ = private_nh.advertise<MapStatus>("status", 1, true);
  publish();  // before the timer, which another thread may serve
  timer_ = private_nh.createWallTimer(
      ros::WallDuration(1.0 / options.rate_hz),
      [this](const ros::WallTimerEvent&) { guarded("status", [this] { publish(); }); });
}

void StatusPublisher::publish() {
  StatusInput input = collect_();
  const uint64_t dropped = input.frames.droppedSum();
  input.newly_dropped = dropped - std::exchange(last_dropped_, dropped);
  input.newly_fused = input.frames.fused - std::exchange(last_fused_, input.frames.fused);
  status_ = makeStatus(input);
  status_.header.frame_id = options_.map_frame;
  status_.header.stamp = ros::Time::now();
  publisher_.publish(status_);
  // Its own timer would wait for simulated time.
  updater_.force_update();
}

void StatusPublisher::fillDiagnostics(
    diagnostic_updater::DiagnosticStatusWrapper& diagnostics) const {
  diagnostics.summary(status_.level, status_.message);
  diagnostics.add("backend", status_.backend);
  diagnostics.add("paused", status_.paused);
  diagnostics.add("images received", status_.images_received);
  diagnostics.add("frames fused", status_.frames_fused);
  diagnostics.add("frames dropped", status_.frames_dropped);
  for (const DropCount& drop : status_.dropped) {
    diagnostics.add("dropped: " + drop.reason, drop.count);
  }
  diagnostics.add("frames waiting", status_.frames_waiting);
  diagnostics.add("blocks", status_.blocks);
  diagnostics.add("voxel arrays", status_.voxel_arrays);
  diagnostics.add("map bytes", status_.map_bytes);
  diagnostics.add("refused blocks", status_.refused_blocks);
  diagnostics.add("triangles", status_.triangles);
  diagnostics.add("integrate ms", status_.integrate_ms);
  diagnostics.add("mesh ms", status_.mesh_ms);
  diagnostics.add("publish ms", status_.publish_ms);
}

}  // namespace dtsdf
