#include "ros/output/status_report.h"

#include <tuple>
#include <utility>

namespace dtsdf {

using dtsdf_mapping::DropCount;
using dtsdf_mapping::MapStatus;

namespace {

using Verdict = std::pair<uint8_t, std::string>;

/// "; depth is published on '/a' and '/b'"; empty without topics.
std::string describeOthers(const std::vector<std::string>& topics) {
  std::string text;
  for (const std::string& topic : topics) {
    text += (text.empty() ? "; depth is published on '" : " and '") + topic + "'";
  }
  return text;
}

/// Nothing comes in that could be fused; empty text if something does.
Verdict judgeInput(const StatusInput& in) {
  if (in.frames.images == 0) {
    const std::string why = in.image_publishers == 0
                                ? "it has no publisher" + describeOthers(in.depth_topics)
                                : "its publisher has sent nothing yet";
    return {MapStatus::WARN, "no depth image received on '" + in.image_topic + "': " + why};
  }
  if (in.frames.camera_infos == 0) {
    return {MapStatus::WARN, "depth images come, but no camera_info on '" + in.info_topic + "'"};
  }
  return {MapStatus::OK, ""};
}

/// Frames come in, but none has become part of the map.
Verdict judgeFirstFrame(const StatusInput& in) {
  if (!in.waiting_for.empty()) return {MapStatus::WARN, "no frame fused yet: " + in.waiting_for};
  if (in.frames.droppedSum() > 0) {
    return {MapStatus::WARN, "no frame fused yet: " + in.frames.last_drop};
  }
  return {MapStatus::OK, "waiting for the first frame with its camera_info and transform"};
}

std::string describeMesh(const StatusInput& in) {
  if (in.output.triangles > 0) return "mapping";
  if (in.mesh_listeners == 0) return "mapping; no mesh yet, as nobody listens to it";
  return "mapping; no triangles yet: no surface has been seen well enough";
}

Verdict judgeProgress(const StatusInput& in) {
  if (in.map.stats.refused_blocks > 0) {
    return {MapStatus::WARN, "the map is full (map/max_memory_mb): " +
                                 std::to_string(in.map.stats.refused_blocks) +
                                 " blocks were refused; what is mapped stays usable"};
  }
  if (in.newly_dropped > in.newly_fused) {
    return {MapStatus::WARN, "most frames are dropped: " + in.frames.last_drop};
  }
  return {MapStatus::OK, describeMesh(in)};
}

Verdict judge(const StatusInput& in) {
  if (!in.map.failure.empty()) {
    return {MapStatus::ERROR, "the backend failed: " + in.map.failure};
  }
  if (in.paused) return {MapStatus::OK, "paused"};
  if (in.frames.fused > 0) return judgeProgress(in);
  const Verdict input = judgeInput(in);
  return input.second.empty() ? judgeFirstFrame(in) : input;
}

}  // namespace

dtsdf_mapping::MapStatus makeStatus(const StatusInput& in) {
  MapStatus status;
  std::tie(status.level, status.message) = judge(in);
  status.backend = in.map.backend;
  status.paused = in.paused;

  status.images_received = in.frames.images;
  status.frames_fused = in.frames.fused;
  status.frames_dropped = in.frames.droppedSum();
  for (int i = 0; i < kDropReasonCount; ++i) {
    if (in.frames.dropped[i] == 0) continue;
    DropCount drop;
    drop.reason = toString(static_cast<DropReason>(i));
    drop.count = in.frames.dropped[i];
    status.dropped.push_back(drop);
  }
  status.frames_waiting = static_cast<uint32_t>(in.frames_waiting);
  status.last_fused_stamp = in.frames.last_fused_stamp;

  status.blocks = in.map.stats.blocks;
  status.voxel_arrays = in.map.stats.voxel_arrays;
  status.map_bytes = in.map.stats.map_bytes;
  status.max_map_bytes = in.max_map_bytes;
  status.refused_blocks = in.map.stats.refused_blocks;
  status.triangles = in.output.triangles;

  status.integrate_ms = static_cast<float>(in.map.integrate_ms);
  status.mesh_ms = static_cast<float>(in.map.mesh_ms);
  status.publish_ms = static_cast<float>(in.output.publish_ms);
  return status;
}

}  // namespace dtsdf
