#include "ros/output/status_report.h"

#include <algorithm>
#include <tuple>

#include "params/printable.h"

namespace dtsdf {

using dtsdf_mapping::CameraStatus;
using dtsdf_mapping::DropCount;
using dtsdf_mapping::MapStatus;
using dtsdf_mapping::StreamStatus;

namespace {

constexpr float kNever = -1.0f;

DropCount dropCount(const std::string& reason, uint64_t count) {
  DropCount drop;
  drop.reason = reason;
  drop.count = count;
  return drop;
}

std::vector<DropCount> dropCounts(const FrameCounts& frames) {
  std::vector<DropCount> counts;
  for (int i = 0; i < kDropReasonCount; ++i) {
    if (frames.dropped[i] == 0) continue;
    counts.push_back(dropCount(toString(static_cast<DropReason>(i)), frames.dropped[i]));
  }
  return counts;
}

float ageOf(const std::optional<double>& age_s) {
  return age_s ? static_cast<float>(*age_s) : kNever;
}

StreamStatus makeStreamStatus(const std::string& kind, const StreamReport& report) {
  StreamStatus status;
  status.kind = kind;
  status.topic = report.image_topic;
  status.received = report.frames.images;
  status.camera_infos = report.frames.camera_infos;
  status.fused = report.frames.fused;
  status.dropped = dropCounts(report.frames);
  status.waiting = static_cast<uint32_t>(report.waiting);
  status.waiting_for = report.waiting_for;
  status.last_drop = report.frames.last_drop;
  status.last_stamp = report.frames.last_stamp;
  status.last_fused_stamp = report.frames.last_fused_stamp;
  status.received_age_s = ageOf(report.frames.image_age_s);
  status.camera_info_age_s = ageOf(report.frames.camera_info_age_s);
  status.fused_age_s = ageOf(report.frames.fused_age_s);
  return status;
}

std::vector<geometry_msgs::Vector3> toVectors(const std::vector<Eigen::Vector3d>& axes) {
  std::vector<geometry_msgs::Vector3> vectors(axes.size());
  for (size_t i = 0; i < axes.size(); ++i) {
    vectors[i].x = axes[i].x();
    vectors[i].y = axes[i].y();
    vectors[i].z = axes[i].z();
  }
  return vectors;
}

/// How depth images fit the map.
dtsdf_mapping::PoseStatus makePoseStatus(const CameraPoseReport& report) {
  dtsdf_mapping::PoseStatus status;
  if (!report.last) return status;
  status.outcome = toString(report.last->status);
  status.stamp = report.stamp;
  status.matched_share = static_cast<float>(report.last->matched_share);
  status.inlier_share = static_cast<float>(report.last->inlier_share);
  status.residual_m = static_cast<float>(report.last->residual_m);
  status.correction_m = static_cast<float>(report.last->shift_m);
  status.correction_rad = static_cast<float>(report.last->turn_rad);
  status.free_shifts = toVectors(report.free_shifts);
  status.free_turns = toVectors(report.free_turns);
  if (report.lost_since_s) status.lost_since = ros::Time(*report.lost_since_s);
  for (int i = 0; i < kAlignmentStatusCount; ++i) {
    if (report.outcomes[i] == 0) continue;
    status.outcomes.push_back(
        dropCount(toString(static_cast<AlignmentStatus>(i)), report.outcomes[i]));
  }
  return status;
}

/// Adds a camera's depth frames to those of all cameras.
void addFrames(const FrameCounts& frames, FrameCounts& sum) {
  sum.images += frames.images;
  sum.fused += frames.fused;
  for (int i = 0; i < kDropReasonCount; ++i) sum.dropped[i] += frames.dropped[i];
  sum.last_fused_stamp = std::max(sum.last_fused_stamp, frames.last_fused_stamp);
}

void fillCameras(const StatusInput& in, MapStatus& status) {
  FrameCounts sum;
  for (const CameraReport& camera : in.cameras) {
    addFrames(camera.depth.frames, sum);
    status.frames_waiting += static_cast<uint32_t>(camera.depth.waiting);
    CameraStatus entry;
    entry.name = camera.name;
    entry.streams.push_back(makeStreamStatus("depth", camera.depth));
    if (camera.colour) entry.streams.push_back(makeStreamStatus("color", *camera.colour));
    const size_t place = status.cameras.size();
    if (place < in.poses.cameras.size()) entry.pose = makePoseStatus(in.poses.cameras[place]);
    status.cameras.push_back(entry);
  }
  status.images_received = sum.images;
  status.frames_fused = sum.fused;
  status.frames_dropped = sum.droppedSum();
  status.dropped = dropCounts(sum);
  status.last_fused_stamp = sum.last_fused_stamp;
}

size_t waitingImageBytes(const std::vector<CameraReport>& cameras) {
  size_t bytes = 0;
  for (const CameraReport& camera : cameras) {
    bytes += camera.depth.waiting_bytes;
    if (camera.colour) bytes += camera.colour->waiting_bytes;
  }
  return bytes;
}

size_t countStreams(const std::vector<CameraReport>& cameras) {
  size_t streams = cameras.size();
  for (const CameraReport& camera : cameras) streams += camera.colour ? 1 : 0;
  return streams;
}

size_t queuedBytes(const std::vector<TopicStatus>& topics) {
  size_t bytes = 0;
  for (const TopicStatus& topic : topics) bytes += topic.waiting_bytes;
  return bytes;
}

void fillMemory(const StatusInput& in, MapStatus& status) {
  const auto add = [&](const char* name, bool on_gpu, uint64_t bytes, uint64_t limit_bytes = 0) {
    dtsdf_mapping::MemoryPart part;
    part.name = name;
    part.place = on_gpu ? "gpu" : "host";
    part.bytes = bytes;
    part.limit_bytes = limit_bytes;
    status.memory.push_back(part);
  };
  const MapStats& stats = in.map.stats;
  const MapperMemory& memory = in.map.memory;
  add("map", memory.on_gpu, stats.map_bytes - stats.colour_bytes, stats.max_map_bytes);
  add("colour", memory.on_gpu, stats.colour_bytes, stats.max_map_bytes);
  const PagedMeshes::Stats& meshes = in.output.paged_meshes;
  const PagedValues::Stats& cells = in.output.paged_space;
  if (stats.pages.written + stats.pages.space_bytes > 0 || meshes.bytes > 0 || cells.bytes > 0) {
    add("page_index", false, stats.pages.index_bytes + meshes.index_bytes + cells.index_bytes);
    add("pages", false, stats.pages.bytes + stats.pages.space_bytes + meshes.bytes + cells.bytes);
    status.memory.back().place = "disk";
  }
  add("spare", memory.on_gpu, memory.spare);
  add("indices", memory.on_gpu, memory.indices);
  add("scratch", memory.on_gpu, memory.scratch);
  if (memory.on_gpu) {
    add("meshes", true, memory.meshes);
    add("staging", false, memory.staging);
  }
  if (memory.space > 0) add("space", false, memory.space + in.output.space_bytes);
  add("mesh", false, in.output.mesh_bytes, in.output.max_mesh_bytes);
  add("images", false, waitingImageBytes(in.cameras),
      countStreams(in.cameras) * in.max_image_bytes);
  add("queues", false, queuedBytes(in.output.topics), in.max_queue_bytes);
  const std::vector<TopicStatus>& space_topics = in.output.space_topics;
  if (!space_topics.empty()) add("space_queues", false, queuedBytes(space_topics));
  if (in.correction.bytes > 0) add("correction", memory.on_gpu, in.correction.bytes);
  if (in.poses.max_trajectory_bytes > 0) {
    add("trajectory", false, in.poses.trajectory_bytes, in.poses.max_trajectory_bytes);
  }
  add("process", false, in.process_bytes);
}

void fillPages(const PageStats& pages, const OutputReport& output, MapStatus& status) {
  status.paged_blocks = pages.blocks;
  status.paged_bytes = pages.bytes;
  status.pages_written = pages.written;
  status.pages_read = pages.read;
  status.pages_lost = pages.lost;
  status.page_failures =
      pages.failures + output.paged_meshes.failures + output.paged_space.failures;
  status.page_waits = pages.waits;
  status.page_wait_s = static_cast<float>(pages.wait_ms / 1000.0);
}

void fillLog(const StatusInput& in, MapStatus& status) {
  status.log_bytes = in.log.bytes;
  status.log_waiting_bytes = in.log.waiting_bytes;
  status.log_lost = in.log.lost;
  status.log_first_stamp = ros::Time(std::max(0.0, in.log.first_stamp_s.value_or(0.0)));
  status.correction_fused = in.correction.fused;
  status.correction_total = in.correction.total;
  status.last_correction = printableMessage(in.correction.last);
}

}  // namespace

bool lacksInput(const CameraReport& camera) {
  const StreamReport& depth = camera.depth;
  return (depth.frames.images == 0 && depth.image_publishers == 0) ||
         depth.frames.camera_infos == 0;
}

dtsdf_mapping::MapStatus makeStatus(const StatusInput& in, const dtsdf_mapping::MapStatus& before) {
  MapStatus status;
  std::tie(status.level, status.message) = judge(in, before);
  status.backend = in.map.backend;
  status.paused = in.paused;
  fillCameras(in, status);

  status.voxel_size_m = in.map.voxel_size_m;
  status.loaded_map = printableMessage(in.map.loaded_map);
  status.blocks = in.map.stats.blocks;
  status.voxel_arrays = in.map.stats.voxel_arrays;
  status.map_bytes = in.map.stats.map_bytes;
  status.map_bytes_peak = in.map.stats.map_bytes_peak;
  status.max_map_bytes = in.map.stats.max_map_bytes;
  status.refused_blocks = in.map.stats.refused_blocks;
  status.refused_cubes = in.map.stats.refused_cubes;
  status.dropped_blocks = in.map.stats.dropped_blocks;
  status.triangles = in.output.triangles;
  fillMemory(in, status);
  status.topics = in.output.topics;
  status.topics.insert(status.topics.end(), in.output.space_topics.begin(),
                       in.output.space_topics.end());

  fillPages(in.map.stats.pages, in.output, status);
  fillLog(in, status);

  status.transforms_refused = in.transforms.refused;
  for (const auto& [what, count] : in.transforms.refused_by) {
    status.refused_transforms.push_back(dropCount(what, count));
  }
  status.transform_age_s = ageOf(in.transforms.age_s);

  status.integrate_ms = static_cast<float>(in.map.integrate_ms);
  status.paint_ms = static_cast<float>(in.map.paint_ms);
  status.mesh_ms = static_cast<float>(in.map.mesh_ms);
  status.publish_ms = static_cast<float>(in.output.publish_ms);
  return status;
}

}  // namespace dtsdf
