/// The live map: fuses frames, extracts the mesh and queues its changes for the output.
#pragma once

#include <ros/console.h>
#include <ros/time.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/partly_cleared.h"
#include "io/map_chunks.h"
#include "params/printable.h"
#include "ros/common/pace.h"
#include "ros/common/status_fields.h"
#include "ros/input/frame_queue.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/mesh_queue.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// While frames arrive, answers to planners should be at most a second old. The interval between
/// mesh updates may take up half of that.
constexpr double kMinSpaceRate_hz = 2.0;

inline void fillMemory(const MapStats& stats, const MapperMemory& memory, MapStatus& status) {
  const char* const place = memory.on_gpu ? kGpu : kHost;
  addMemory(status, "map", place, stats.map_bytes - stats.colour_bytes, stats.max_map_bytes);
  addMemory(status, "colour", place, stats.colour_bytes, stats.max_map_bytes);
  addMemory(status, "spare", place, memory.spare);
  addMemory(status, "indices", place, memory.indices);
  addMemory(status, "scratch", place, memory.scratch);
  if (memory.on_gpu) {
    addMemory(status, "meshes", place, memory.meshes);
    addMemory(status, "staging", kHost, memory.staging);
  }
  if (memory.space > 0) addMemory(status, "space", kHost, memory.space);
}

inline void fillStats(const MapStats& stats, MapStatus& status) {
  status.blocks = stats.blocks;
  status.map_bytes = stats.map_bytes;
  status.max_map_bytes = stats.max_map_bytes;
  status.refused_blocks = stats.refused_blocks;
  status.refused_cubes = stats.refused_cubes;
  status.dropped_blocks = stats.dropped_blocks;
  const PageStats& pages = stats.pages;
  status.paged_blocks = pages.blocks;
  status.paged_bytes = pages.bytes;
  status.pages_lost = pages.lost;
  status.page_failures = 0;  // addPages() adds to it
  status.page_waits = pages.waits;
  status.page_wait_s = static_cast<float>(pages.wait_ms / 1000.0);
  addPages(status, pages, "blocks or free-space sectors");
}

/// Reports what did not fit into the budget since the map was last cleared or replaced.
inline void reportBudget(const MapStats& stats, MapStatus& status) {
  const std::string of_disk = " because map/page_folder is full or fails: " + stats.pages.problem;
  const bool is_disk = stats.pages.failures > 0;
  const auto warn = [&](uint8_t code, uint64_t count, const char* what, const char* remedy) {
    if (count == 0) return;
    report(status, MapStatus::WARN, is_disk ? MapStatus::DISK_FULL : code,
           std::to_string(count) + what + (is_disk ? of_disk : remedy));
  };
  warn(MapStatus::MAP_FULL, stats.refused_blocks, " blocks were refused",
       " because the map is full; it stays usable; raise map/max_memory_mb or set "
       "map/keep_radius_m or map/page_folder");
  warn(MapStatus::SPACE_FULL, stats.refused_cubes, " free-space cubes stayed unknown",
       " because the memory for free-space cells (an eighth of map/max_memory_mb) is full; "
       "surfaces are still mapped; raise map/max_memory_mb or space/cell_voxels");
}

/// Used on the map thread only, except fill() and throwIfFailed(). Never waits for transforms, nor
/// for threads that publish or save the mesh.
///
/// Fusing frames and extracting the mesh alternate. On a GPU, an extraction runs while the next
/// frame is fused, and is finished after that frame. It is finished immediately if no frame is
/// waiting, or if its result is ready, as on a CPU.
class LiveMap {
 public:
  /// All references must outlive this object.
  LiveMap(std::unique_ptr<Mapper> mapper, const NodeParams& params, FrameQueue& frames,
          const MapFrame& frame, MeshQueue& mesh_changes, const Steps& steps,
          SteadyClock clock = std::chrono::steady_clock::now)
      : mapper_(std::move(mapper)),
        params_(params),
        settings_(params.mapper),
        frames_(frames),
        frame_(frame),
        mesh_changes_(mesh_changes),
        steps_(steps),
        clock_(std::move(clock)) {
    report_.backend = mapper_->backendName();
    updateReport();  // reports the budget before the first frame
  }

  /// Performs the first task that is due. @return the time until the next call. After a failure of
  /// the backend, frames are dropped until clear() or replace().
  std::chrono::milliseconds step() noexcept {
    try {
      if (!act()) return idleTime();
    } catch (const std::exception& error) {
      fail(errorText(error));
    } catch (...) {
      fail("unknown error");
    }
    return std::chrono::milliseconds(0);
  }

  Mapper& mapper() { return *mapper_; }
  /// Settings of the current map; only replace() changes them.
  const MapperParams& settings() const { return settings_; }

  /// What a map file stores in addition to the mapper's data.
  MapOrigin origin(const std::string& map_frame = std::string()) const {
    const PoseParams& poses = params_.poses;
    return {map_frame, frame_.level(), map_stamp_.isZero() ? loaded_stamp_s_ : map_stamp_.toSec(),
            poses.mode == PoseMode::kTf ? PoseParams() : poses};
  }

  /// Stamp of the newest frame in the last finished extraction.
  const ros::Time& meshStamp() const { return surfaces_stamp_; }
  /// Size of the map in bytes, as of the last report.
  size_t mapBytes() const { return report_.map_bytes; }

  /// Brings the mesh up to date; if isMeshPart() is true afterwards, call it again. Works even
  /// after a failure if the map is still usable; if it is not, the mesh stays as it was.
  /// @return a note on how the mesh differs from the map; empty if it does not.
  std::string flushMesh() {
    try {
      // A failed backend may still have its map, for example after a GPU has run out of memory.
      if (is_extracting_) finishMesh();
      if (mesh_whole_ && fused_since_mesh_) {
        beginMesh();
        finishMesh();
      }
    } catch (const std::exception& error) {
      fail(errorText(error));
    }
    // A failed extraction loses its changes, so the mesh can no longer be brought up to date.
    return mesh_whole_
               ? ""
               : "; the backend has failed, so this is the last extracted mesh: " + failure_;
  }

  /// Whether the last extraction left work for the next extraction.
  bool isMeshPart() const { return mesh_is_part_; }

  /// Empties a part of the map. @pre The region is valid.
  /// @throws std::runtime_error if the backend has failed or fails.
  ClearedRegion clearRegion(const Region& region) {
    throwIfFailed();
    try {
      const ClearedRegion cleared = mapper_->clearRegion(region);
      regionCleared(region);
      return cleared;
    } catch (const PartlyCleared&) {  // the disk failed, not the backend
      regionCleared(region);
      throw;
    } catch (const std::exception& error) {
      fail(errorText(error));
      throw;
    }
  }

  /// Whether a second map of this size fits into the budget, and no blocks are on disk; true after
  /// a failure.
  bool hasRoomFor(size_t bytes) const {
    if (hasFailed()) return true;  // the failed map is discarded anyway
    const MapStats stats = mapper_->stats();
    return stats.pages.blocks == 0 && stats.map_bytes + bytes <= stats.max_map_bytes;
  }

  /// Whether the map is empty. A failed map does not count as empty.
  bool isEmpty() const {
    if (hasFailed()) return false;  // querying the mapper could fail
    const MapStats stats = mapper_->stats();
    return stats.blocks + stats.pages.blocks == 0;
  }

  /// Continues with a loaded map in a new mapper, even after a failure; the whole mesh is
  /// extracted again. @return the previous mapper.
  std::unique_ptr<Mapper> replace(std::unique_ptr<Mapper> mapper, const MapperParams& settings,
                                  const std::string& path, const MapContents& loaded,
                                  const std::shared_ptr<const MapChunks>& file = nullptr) {
    mapper_.swap(mapper);
    settings_ = settings;
    loaded_stamp_s_ = loaded.stamp_s;
    fused_since_mesh_ = true;
    startOver(&loaded, file);
    const std::lock_guard<std::mutex> lock(report_mutex_);
    report_.loaded_map = printableMessage(path);
    return mapper;
  }

  /// Continues with a map of the same frames at corrected poses, and with its whole mesh. @return
  /// the previous mapper.
  std::unique_ptr<Mapper> replaceCorrected(std::unique_ptr<Mapper> mapper,
                                           const std::map<PackedKey, SharedBlockMesh>& mesh) {
    mapper_.swap(mapper);
    is_extracting_ = fused_since_mesh_ = mesh_is_part_ = false;
    mesh_whole_ = true;
    mesh_stamp_ = surfaces_stamp_ = map_stamp_;
    mesh_changes_.replaceAll(mesh, mesh_stamp_);
    for (const auto& step : steps_) step->corrected();
    updateReport();
    return mapper;
  }

  /// Empties map and mesh, even after a failure.
  /// @throws std::runtime_error if the backend fails.
  void clear() {
    mapper_->clear();
    loaded_stamp_s_ = 0.0;
    fused_since_mesh_ = false;
    startOver(nullptr, nullptr);
  }

  /// On any thread: overwrites the status with the map's part.
  void fill(MapStatus& status) const {
    const std::lock_guard<std::mutex> lock(report_mutex_);
    status = report_;
    if (!hasFailed()) return;
    report(status, MapStatus::ERROR, MapStatus::BACKEND_FAILED, "the backend failed: " + failure_);
  }

  /// May be called on any thread. @throws std::runtime_error if the backend has failed.
  void throwIfFailed() const {
    const std::lock_guard<std::mutex> lock(report_mutex_);
    if (!hasFailed()) return;
    throw std::runtime_error("the map's backend has failed (" + failure_ +
                             "); call clear_map to start over");
  }

 private:
  /// Performs the first task that is due. @return false if there is none.
  bool act() {
    const bool frame_ready = frames_.hasTurn();
    if (hasFailed()) {
      if (frame_ready) fuseNext();
      return frame_ready;
    }
    if (updateMesh(frame_ready)) return true;
    if (report_outdated_ && !frame_ready) updateReport();
    for (const auto& step : steps_) {
      if (step->work(frame_ready)) return true;
    }
    if (frame_ready) fuseNext();
    return frame_ready;
  }

  /// Finishes an extraction, or begins one. @return false if neither is due.
  bool updateMesh(bool frame_ready) {
    if (is_extracting_ && (fused_since_mesh_ || mapper_->isMeshMade() || !frame_ready)) {
      finishMesh();
      return true;
    }
    const auto next = nextMesh();
    if (!next || *next > clock_()) return false;
    beginMesh();
    return true;
  }

  /// When to begin an extraction; none if no step needs the mesh, nothing has changed or an
  /// extraction is running.
  std::optional<SteadyTime> nextMesh() {
    if (!fused_since_mesh_ || is_extracting_) return std::nullopt;
    std::optional<double> rate_hz;
    for (const auto& step : steps_) rate_hz = std::max(rate_hz, step->meshRate_hz());
    if (!rate_hz) return std::nullopt;
    mesh_pace_.setRate(*rate_hz, clock_());
    return mesh_pace_.next();
  }

  std::chrono::milliseconds idleTime() {
    // Polls, because new subscribers do not wake the loop.
    constexpr SteadyDuration kIdle = std::chrono::milliseconds(50);
    SteadyDuration idle = std::min(kIdle, frames_.idleTime());
    if (const auto next = hasFailed() ? std::nullopt : nextMesh()) {
      idle = std::min(idle, std::max(SteadyDuration::zero(), *next - clock_()));
    }
    return toMilliseconds(idle);
  }

  void fuseNext() {
    std::optional<PosedFrame> frame = frames_.take();
    if (!frame) return;  // dropped in the meantime
    if (hasFailed()) {
      return frame->accounting->dropped({drop::kBackendError, failure_}, frame->stamp);
    }
    try {
      takeFrame(*frame);
    } catch (const std::exception& error) {
      frame->accounting->dropped({drop::kBackendError, errorText(error)}, frame->stamp);
      throw;
    }
    updateReport();
  }

  void takeFrame(PosedFrame& frame) {
    if (const auto rejection = place(frame)) {
      return frame.accounting->dropped(*rejection, frame.stamp);
    }
    const IntegrationResult result = integrate(frame);
    if (result.status == FrameStatus::kFused) {
      // Colour may come late; if stamps of depth go back, a recording has started over.
      const bool is_depth = std::holds_alternative<DepthFrame>(frame.image);
      map_stamp_ = is_depth ? frame.stamp : std::max(map_stamp_, frame.stamp);
      frame.accounting->fused(frame.stamp);
      fused_since_mesh_ = true;
    } else {
      frame.accounting->dropped({dropReasonOf(result.status), result.message}, frame.stamp);
    }
    for (const auto& step : steps_) step->fused(frame, result);
  }

  std::optional<Rejection> place(PosedFrame& frame) const {
    for (const auto& step : steps_) {
      if (auto rejection = step->expect(frame)) return rejection;
    }
    for (const auto& step : steps_) {
      if (auto rejection = step->place(frame)) return rejection;
    }
    return std::nullopt;
  }

  IntegrationResult integrate(const PosedFrame& frame) {
    const auto* depth = std::get_if<DepthFrame>(&frame.image);
    IntegrationResult result = depth != nullptr
                                   ? mapper_->integrate(*depth)
                                   : mapper_->paint(std::get<ColourFrame>(frame.image));
    const std::lock_guard<std::mutex> lock(report_mutex_);
    if (result.status == FrameStatus::kFused) {
      (depth != nullptr ? report_.integrate_ms : report_.paint_ms) =
          static_cast<float>(result.duration_ms);
    }
    return result;
  }

  void beginMesh() {
    mesh_whole_ = false;  // in case the next line throws
    mapper_->beginMeshUpdate();
    mesh_stamp_ = map_stamp_;
    mesh_pace_.begin(clock_());
    is_extracting_ = true;
    fused_since_mesh_ = false;
  }

  void finishMesh() {
    is_extracting_ = false;
    MeshUpdate update = mapper_->finishMeshUpdate();
    // Frames get at least as much of the thread's time as the mesh.
    mesh_pace_.restUntil(clock_() + toSteadyDuration(update.duration_ms / 1000.0));
    mesh_is_part_ = update.is_part;
    fused_since_mesh_ = fused_since_mesh_ || mesh_is_part_;
    {
      const std::lock_guard<std::mutex> lock(report_mutex_);
      report_.mesh_ms = static_cast<float>(update.duration_ms);
    }
    mesh_changes_.add(std::move(update), mesh_stamp_);
    mesh_whole_ = true;
    surfaces_stamp_ = mesh_stamp_;
    report_outdated_ = true;
    for (const auto& step : steps_) step->meshed();
  }

  /// Resets the state for another map, whose mesh has not been extracted yet.
  void startOver(const MapContents* loaded, const std::shared_ptr<const MapChunks>& file) {
    mesh_changes_.clear(settings_.map.voxel_size_m);
    is_extracting_ = mesh_is_part_ = false;
    mesh_whole_ = true;
    map_stamp_ = mesh_stamp_ = surfaces_stamp_ = ros::Time();
    for (const auto& step : steps_) step->replaced(loaded, file);
    {
      const std::lock_guard<std::mutex> lock(report_mutex_);
      report_.loaded_map.clear();
      failure_.clear();
    }
    updateReport();
  }

  void regionCleared(const Region& region) {
    for (const auto& step : steps_) step->regionCleared(region);
    fused_since_mesh_ = report_outdated_ = true;
  }

  /// After an extraction, this waits until blocks have been moved to disk. So step() calls it only
  /// while no frame is ready, or after fusing a frame, which has already waited for the disk.
  void updateReport() {
    report_outdated_ = false;
    const MapStats stats = mapper_->stats();
    const MapperMemory memory = mapper_->memory();
    const std::lock_guard<std::mutex> lock(report_mutex_);
    report_.level = MapStatus::OK;
    report_.code = MapStatus::MAPPING;
    report_.message = "mapping";
    report_.memory.clear();
    report_.voxel_size_m = settings_.map.voxel_size_m;
    fillStats(stats, report_);
    fillMemory(stats, memory, report_);
    reportBudget(stats, report_);
  }

  bool hasFailed() const { return !failure_.empty(); }
  void fail(const std::string& text) {
    ROS_FATAL_STREAM_NAMED("dtsdf_mapping",
                           "the map's backend failed; call clear_map to start over: " << text);
    for (const auto& step : steps_) step->failed();
    const std::lock_guard<std::mutex> lock(report_mutex_);
    failure_ = text;
  }

  std::unique_ptr<Mapper> mapper_;
  const NodeParams& params_;
  MapperParams settings_;
  FrameQueue& frames_;
  const MapFrame& frame_;
  MeshQueue& mesh_changes_;
  const Steps& steps_;
  const SteadyClock clock_;

  Pace mesh_pace_{kMinSpaceRate_hz};
  bool is_extracting_ = false;
  bool fused_since_mesh_ = false;  ///< Whether the map may differ from the mesh.
  bool report_outdated_ = false;
  bool mesh_is_part_ = false;
  bool mesh_whole_ = true;       ///< False during an extraction, and after a failed one.
  ros::Time map_stamp_;          ///< Stamp of the newest frame fused into this map.
  double loaded_stamp_s_ = 0.0;  ///< Stamp of a loaded map's newest frame; 0: none.
  ros::Time mesh_stamp_;         ///< The map's stamp when the last extraction was begun.
  ros::Time surfaces_stamp_;     ///< The map's stamp when the last finished extraction was begun.

  mutable std::mutex report_mutex_;
  // Guarded by report_mutex_; only the map thread writes them, so it reads them without a lock.
  std::string failure_;  ///< Failure of the backend; empty while it works.
  MapStatus report_;     ///< The map's part of the status.
};

}  // namespace dtsdf
