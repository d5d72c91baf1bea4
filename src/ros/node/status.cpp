#include "ros/node/status.h"

#include <ros/console.h>
#include <unistd.h>

#include <fstream>
#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/common/status_fields.h"

namespace dtsdf {

using dtsdf_mapping::CameraStatus;
using dtsdf_mapping::DropCount;
using dtsdf_mapping::MemoryPart;
using dtsdf_mapping::PoseStatus;
using dtsdf_mapping::StreamStatus;
using dtsdf_mapping::TopicStatus;

namespace {

/// What of one camera is not in the sums over all.
void addCamera(const CameraStatus& camera,
               diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
  for (const StreamStatus& stream : camera.streams) {
    const std::string begin = camera.name + " " + stream.kind + ": ";
    diagnostics.add(begin + "received", stream.received);
    diagnostics.add(begin + "fused", stream.fused);
    for (const DropCount& drop : stream.dropped) {
      diagnostics.add(begin + "dropped: " + drop.reason, drop.count);
    }
    diagnostics.add(begin + "waiting", stream.waiting);
  }
}

/// How its newest depth image fits the map, where that was asked for.
void addPose(const CameraStatus& camera, diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
  const PoseStatus& pose = camera.pose;
  if (pose.outcome.empty()) return;
  const std::string begin = (camera.name.empty() ? "" : camera.name + " ") + "pose";
  diagnostics.add(begin, pose.outcome);
  diagnostics.add(begin + ": points that fit, %", 100.0f * pose.inlier_share);
  diagnostics.add(begin + ": residual mm", 1000.0f * pose.residual_m);
  diagnostics.add(begin + ": correction mm", 1000.0f * pose.correction_m);
  diagnostics.add(begin + ": correction rad", pose.correction_rad);
  diagnostics.add(begin + ": axes not held", pose.free_shifts.size() + pose.free_turns.size());
  diagnostics.add(begin + ": lost", pose.lost_since.isZero() ? "no" : "yes");
}

/// Resident memory of this process; 0 where the system does not report it.
uint64_t residentBytes() {
  std::ifstream statm("/proc/self/statm");
  uint64_t all_pages = 0, resident_pages = 0;
  if (!(statm >> all_pages >> resident_pages)) return 0;
  return resident_pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

StatusPublisher::StatusPublisher(const ros::NodeHandle& nh, ros::NodeHandle private_nh,
                                 std::string map_frame, double rate_hz,
                                 std::function<void(MapStatus&)> fill)
    : map_frame_(std::move(map_frame)),
      fill_(std::move(fill)),
      updater_(nh, private_nh, private_nh.getNamespace()) {
  updater_.setHardwareID("none");
  updater_.add("mapping", [this](diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
    fillDiagnostics(diagnostics);
  });
  // Latched: a tool that asks once gets the answer at once.
  publisher_ = private_nh.advertise<MapStatus>("status", 1, true);
  publish();  // before the timer, which another thread may serve
  timer_ = private_nh.createWallTimer(
      ros::WallDuration(1.0 / rate_hz),
      [this](const ros::WallTimerEvent&) { guarded("status", [this] { publish(); }); });
}

void StatusPublisher::publish() {
  MapStatus status;
  fill_(status);
  addMemory(status, "process", kHost, residentBytes());
  status.header.frame_id = map_frame_;
  status.header.stamp = ros::Time::now();
  status_ = std::move(status);
  publisher_.publish(status_);
  const SteadyTime now = std::chrono::steady_clock::now();
  if (trouble_log_.update(status_.level == MapStatus::OK, status_.code, now)) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", status_.message);
  }
  // Its own timer would wait for simulated time.
  updater_.force_update();
}

void StatusPublisher::fillDiagnostics(
    diagnostic_updater::DiagnosticStatusWrapper& diagnostics) const {
  diagnostics.summary(status_.level, status_.message);
  diagnostics.add("code", static_cast<int>(status_.code));
  diagnostics.add("backend", status_.backend);
  diagnostics.add("paused", status_.paused);
  diagnostics.add("images received", status_.images_received);
  diagnostics.add("frames fused", status_.frames_fused);
  diagnostics.add("frames dropped", status_.frames_dropped);
  for (const DropCount& drop : status_.dropped) {
    diagnostics.add("dropped: " + drop.reason, drop.count);
  }
  diagnostics.add("transforms refused", status_.transforms_refused);
  diagnostics.add("transforms restarted", status_.transform_restarts);
  diagnostics.add("frames waiting", status_.frames_waiting);
  for (const CameraStatus& camera : status_.cameras) {
    if (!camera.name.empty()) addCamera(camera, diagnostics);
    addPose(camera, diagnostics);
  }
  diagnostics.add("blocks", status_.blocks);
  diagnostics.add("voxel arrays", status_.voxel_arrays);
  for (const MemoryPart& part : status_.memory) {
    diagnostics.add(part.place + " bytes: " + part.name, part.bytes);
  }
  for (const TopicStatus& topic : status_.topics) {
    diagnostics.add(topic.topic + ": listeners", topic.listeners);
    diagnostics.add(topic.topic + ": bytes published", topic.bytes);
    diagnostics.add(topic.topic + ": chunks to publish", topic.lacking_chunks);
  }
  diagnostics.add("refused blocks", status_.refused_blocks);
  diagnostics.add("triangles", status_.triangles);
  diagnostics.add("journal bytes", status_.journal_bytes);
  diagnostics.add("journal lost", status_.journal_lost);
  diagnostics.add("last correction", status_.last_correction);
  diagnostics.add("integrate ms", status_.integrate_ms);
  diagnostics.add("mesh ms", status_.mesh_ms);
  diagnostics.add("publish ms", status_.publish_ms);
}

}  // namespace dtsdf
