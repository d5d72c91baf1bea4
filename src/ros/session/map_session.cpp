#include "ros/session/map_session.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <stdexcept>

#include "ros/input/depth_image.h"

namespace dtsdf {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAgain{0};
/// How often a waiting frame asks for its transform.
constexpr milliseconds kTransformPoll{5};
constexpr milliseconds kIdle{50};
/// How old the report may be while frames come one after the other: to ask for the map's counts is
/// to wait for the GPU.
constexpr milliseconds kReportPeriod{100};

/// The next time something with a bounded rate may happen again.
std::chrono::steady_clock::time_point afterPeriod(double rate_hz) {
  using Clock = std::chrono::steady_clock;
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / rate_hz));
}

}  // namespace

MapSession::MapSession(const MappingParams& params, const Parts& parts)
    : params_(params),
      parts_(parts),
      mapper_(makeMapper(params.mapper)),
      mesh_(params.mapper.map.voxel_size_m) {
  report_.backend = mapper_->backendName();
}

std::chrono::milliseconds MapSession::step() noexcept {
  try {
    const bool fused = fuseNext();
    updateMeshWhenDue(!fused);
    publishWhenDue();
    if (report_outdated_ && (!fused || Clock::now() >= next_report_)) updateReport();
    if (fused) return kAgain;
    return parts_.intake.size() > 0 ? kTransformPoll : kIdle;
  } catch (const std::exception& error) {
    fail(error.what());
  } catch (...) {
    fail("unknown error");
  }
  return kIdle;
}

bool MapSession::fuseNext() {
  const std::optional<PosedFrame> frame = parts_.intake.next();
  if (!frame) return false;
  if (!report_.failure.empty()) {
    parts_.accounting.dropped(DropReason::kBackendError, frame->image->header.stamp,
                              report_.failure);
    return true;
  }
  fuse(*frame);
  return true;
}

void MapSession::fuse(const PosedFrame& frame) {
  const ros::Time stamp = frame.image->header.stamp;
  const InputParams& input = params_.node.input;
  DepthFrame depth = makeDepthFrame(*frame.image, *frame.info,
                                    {input.unit_16uc1_m, input.unit_32fc1_m}, repacked_);
  depth.T_W_C = frame.T_W_C;
  const IntegrationResult result = mapper_->integrate(depth);
  if (result.status != FrameStatus::kFused) {
    parts_.accounting.dropped(dropReasonOf(result.status), stamp, result.message);
    return;
  }
  parts_.accounting.fused(stamp);
  mesh_stamp_ = stamp;
  map_changed_ = true;
  ++frames_since_begin_;
  if (result.refused_blocks > 0) {
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "the map is full: " << result.refused_blocks
                                                       << " blocks of the last frame were refused; "
                                                          "raise map/max_memory_mb, or clear_map");
  }
  {
    const std::lock_guard<std::mutex> lock(report_mutex_);
    report_.integrate_ms = result.duration_ms;
  }
  report_outdated_ = true;
}

void MapSession::updateMeshWhenDue(bool idle) {
  // On a GPU the extraction runs beside the next frame; it is fetched after that, or when idle.
  if (mesh_begun_ && (idle || frames_since_begin_ > 0)) finishMesh();
  const bool wanted =
      parts_.mesh_publisher.hasListeners() || parts_.points_publisher.hasListeners();
  if (mesh_begun_ || !wanted || !map_changed_ || !report_.failure.empty()) return;
  if (Clock::now() < next_mesh_) return;
  next_mesh_ = afterPeriod(
      std::max(params_.node.publish.mesh_rate_hz, params_.node.publish.points_rate_hz));
  mapper_->beginMeshUpdate();
  mesh_begun_ = true;
  map_changed_ = false;
  frames_since_begin_ = 0;
  if (idle) finishMesh();
}

void MapSession::finishMesh() {
  mesh_begun_ = false;
  mesh_whole_ = false;  // should the next lines fail
  const MeshUpdate update = mapper_->finishMeshUpdate();
  mesh_.apply(update);
  mesh_whole_ = true;
  parts_.mesh_publisher.noteChanges(update);
  if (!update.blocks.empty()) parts_.points_publisher.noteChanges();
  // Where the mesh takes long, frames get at least as much of the worker's time as it does.
  next_mesh_ = std::max(next_mesh_, afterPeriod(1000.0 / std::max(update.duration_ms, 1.0)));
  {
    const std::lock_guard<std::mutex> lock(report_mutex_);
    report_.mesh_ms = update.duration_ms;
  }
  report_outdated_ = true;
}

void MapSession::updateMesh() {
  if (mesh_begun_) finishMesh();
  if (!map_changed_) return;
  mapper_->beginMeshUpdate();
  map_changed_ = false;
  finishMesh();
}

void MapSession::publishWhenDue() {
  const PublishParams& publish = params_.node.publish;
  const Clock::time_point start = Clock::now();
  bool published = false;
  if (parts_.mesh_publisher.hasListeners() && parts_.mesh_publisher.hasChanges() &&
      start >= next_publish_) {
    parts_.mesh_publisher.publishChanges(mesh_);
    next_publish_ = afterPeriod(publish.mesh_rate_hz);
    published = true;
  }
  if (parts_.points_publisher.isDue() && start >= next_points_) {
    parts_.points_publisher.publish(mesh_.assemble(), mesh_stamp_);
    next_points_ = afterPeriod(publish.points_rate_hz);
    published = true;
  }
  if (!published) return;
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.publish_ms =
      std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void MapSession::publishAll(const ros::SingleSubscriberPublisher& newcomer) {
  if (report_.failure.empty()) updateMesh();
  parts_.mesh_publisher.publishAll(mesh_, newcomer);
}

Mesh MapSession::currentMesh() {
  if (!mesh_whole_) {
    throw std::runtime_error("the backend failed while it extracted the mesh, which is incomplete "
                             "now; clear_map, or restart the node");
  }
  // A backend that failed may still have its map, as a GPU does that has run out of memory.
  updateMesh();
  return mesh_.assemble();
}

void MapSession::clear() {
  mapper_->clear();
  mesh_.clear();
  mesh_begun_ = map_changed_ = false;
  mesh_whole_ = true;
  parts_.mesh_publisher.noteCleared();
  parts_.points_publisher.noteChanges();
  updateReport();
}

void MapSession::updateReport() {
  report_outdated_ = false;
  next_report_ = Clock::now() + kReportPeriod;
  const MapStats stats = mapper_->stats();
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.stats = stats;
  report_.triangles = mesh_.triangleCount();
}

void MapSession::fail(const std::string& text) {
  ROS_FATAL_STREAM_NAMED("dtsdf_mapping", "the map's backend failed, nothing is fused any more: "
                                              << text);
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.failure = text;
}

MapReport MapSession::report() const {
  const std::lock_guard<std::mutex> lock(report_mutex_);
  return report_;
}

}  // namespace dtsdf
