#include "ros/output/status_publisher.h"

#include <ros/console.h>
#include <unistd.h>
#include <algorithm>

#include <algorithm>
#include <fstream>
#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/input/published_topics.h"

namespace dtsdf {

using dtsdf_mapping::CameraStatus;
using dtsdf_mapping::DropCount;
using dtsdf_mapping::MapStatus;
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
  const SteadyTime now = std::chrono::steady_clock::now();
  run_clock_.update({now, ros::Time::now(), input.paused});
  input.recent_drops = recent_drops_.update(input.cameras, now);
  input.time_stands = run_clock_.timeStands();
  input.ran_s = run_clock_.ran_s();
  input.process_bytes = residentBytes();
  status_ = makeStatus(input, status_);
  status_.header.frame_id = options_.map_frame;
  status_.header.stamp = ros::Time::now();
  publisher_.publish(status_);
  if (trouble_log_.update(status_.level == MapStatus::OK, status_.message, now)) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", status_.message);
  }
  if (const CameraReport* camera = colour_hint_.update(input.cameras, now)) hintAtColour(*camera);
  // Its own timer would wait for simulated time.
  updater_.force_update();
}

void StatusPublisher::hintAtColour(const CameraReport& camera) {
  const std::vector<std::string> topics = findPublishedTopics().colour;
  if (topics.empty()) return;
  const std::string& wanted = camera.colour->image_topic;
  // Topics are named without their transport.
  const bool is_compressed = std::find(topics.begin(), topics.end(), wanted) != topics.end();
  const std::string hint = is_compressed
                               ? "it is published compressed; set color_image_transport:=compressed"
                               : "colour is published on " + inQuotes(topics) + " (color:=)";
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "no colour image received on '"
                                             << wanted << "': it has no publisher; " << hint);
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
  diagnostics.add("transforms refused", status_.transforms_refused);
  for (const DropCount& refused : status_.refused_transforms) {
    diagnostics.add("refused: " + refused.reason, refused.count);
  }
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
    diagnostics.add(topic.topic + ": bytes sent", topic.bytes);
    diagnostics.add(topic.topic + ": stalled s", topic.stalled_s);
  }
  diagnostics.add("refused blocks", status_.refused_blocks);
  diagnostics.add("triangles", status_.triangles);
  diagnostics.add("log bytes", status_.log_bytes);
  diagnostics.add("log lost", status_.log_lost);
  diagnostics.add("last correction", status_.last_correction);
  diagnostics.add("integrate ms", status_.integrate_ms);
  diagnostics.add("mesh ms", status_.mesh_ms);
  diagnostics.add("publish ms", status_.publish_ms);
}

}  // namespace dtsdf
