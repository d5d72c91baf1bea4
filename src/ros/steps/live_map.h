/// The map at work: fuses the frames that come, extracts the mesh and hands over what changed.
#pragma once

#include <dtsdf_mapping/MapStatus.h>
#include <ros/time.h>

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "ros/common/pace.h"
#include "ros/input/frame_queue.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/mesh_queue.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// What planners are answered is to be no older than a second while frames come: half of it is left
/// to the mesh and to distances.
constexpr double kLeastSpaceRate_hz = 2.0;

/// Map's thread only, but for fill() and throwIfFailed(). It waits for nobody: neither for
/// transforms nor for whoever shows or saves the mesh.
///
/// Frames and the mesh take turns. An extraction that is begun runs beside the next frame (on a
/// GPU) and is finished after it, or at once while no frame is there, or where it is made already
/// (on a CPU).
class LiveMap {
 public:
  /// What is given by reference outlives it.
  LiveMap(std::unique_ptr<Mapper> mapper, const MappingParams& params, FrameQueue& frames,
          const MapFrame& frame, MeshQueue& mesh_changes, const Steps& steps,
          SteadyClock clock = std::chrono::steady_clock::now);

  /// Does what is due. Returns how long there will be nothing to do. After a failure of the backend
  /// frames are dropped until clear() has made a new start.
  std::chrono::milliseconds step() noexcept;

  Mapper& mapper() { return *mapper_; }

  /// What the map's file says beside what the mapper knows.
  MapOrigin origin(const std::string& map_frame = std::string()) const;
  /// Of the newest frame whose surfaces are in the extraction finished last.
  const ros::Time& meshStamp() const { return surfaces_stamp_; }
  /// As it was counted last.
  size_t mapBytes() const { return report_.map_bytes; }

  /// Hands over what the mesh lacks, or a part of it, also after a failure that has left the map
  /// usable. Where it has not, the mesh stays what was handed over last.
  /// @return in what it is not that of the map then; empty: in nothing.
  std::string flushMesh();
  /// Whether the last extraction has left something to the next one.
  bool isMeshPart() const { return mesh_is_part_; }

  /// Empties a part of the map.
  /// @throws std::runtime_error if the region has a problem, or the backend has failed, or fails.
  ClearedRegion clearRegion(const Region& region);

  /// Whether a second map of so many bytes fits beside it into the budget.
  bool hasRoomFor(size_t bytes) const {
    if (hasFailed()) return true;  // it goes all the same
    const MapStats stats = mapper_->stats();
    return stats.pages.blocks == 0 && stats.map_bytes + bytes <= stats.max_map_bytes;
  }
  /// Whether nothing is mapped; no map that has failed counts as empty.
  bool isEmpty() const;

  /// Goes on with a map that was loaded, in a mapper of its own, and starts over after a failure;
  /// the whole mesh is handed over again. @return the mapper so far.
  std::unique_ptr<Mapper> replace(std::unique_ptr<Mapper> mapper, float voxel_size_m,
                                  const std::string& path, const Replacement& loaded);

  /// The map of corrected poses, with all frames that this one has, and its whole mesh. @return the
  /// mapper so far.
  std::unique_ptr<Mapper> replaceCorrected(std::unique_ptr<Mapper> mapper,
                                           const std::map<PackedKey, SharedBlockMesh>& mesh);

  /// Empties map and mesh, and starts over after a failure.
  /// @throws std::runtime_error if the backend cannot even do that.
  void clear();

  /// Any thread: its part of the status, in place of what is in it.
  void fill(dtsdf_mapping::MapStatus& status) const;

  /// Any thread. @throws std::runtime_error after a failure of the backend; its text says so.
  void throwIfFailed() const;

 private:
  bool act();
  bool updateMesh(bool frame_ready);
  std::optional<SteadyTime> nextMesh();
  std::chrono::milliseconds idleTime();
  void fuseNext();
  void takeFrame(PosedFrame& frame);
  std::optional<Rejection> place(PosedFrame& frame) const;
  IntegrationResult integrate(const PosedFrame& frame);
  void beginMesh();
  void finishMesh();
  void startOver(const Replacement& replacement);
  void regionCleared(const Region& region);
  std::string outdatedMesh() const;
  void forgetFailure();
  void updateReport();
  bool hasFailed() const { return !failure_.empty(); }
  void fail(const std::string& text);

  std::unique_ptr<Mapper> mapper_;
  const MappingParams& params_;
  FrameQueue& frames_;
  const MapFrame& frame_;
  MeshQueue& mesh_changes_;
  const Steps& steps_;
  const SteadyClock clock_;

  Pace mesh_pace_{kLeastSpaceRate_hz}, report_pace_;
  bool mesh_under_way_ = false;
  bool fused_since_mesh_ = false;  ///< Since the last extraction was begun.
  bool report_outdated_ = false;
  bool mesh_is_part_ = false;
  bool mesh_whole_ = true;       ///< False while an extraction is under way, and once one was lost.
  ros::Time map_stamp_;          ///< Of the newest frame in the map, but for those of a loaded one.
  double loaded_stamp_s_ = 0.0;  ///< Of those; 0: none.
  ros::Time mesh_stamp_;         ///< The same when the last extraction was begun.
  ros::Time surfaces_stamp_;     ///< That of the last one that was finished.

  mutable std::mutex report_mutex_;
  // Only this thread writes.
  std::string failure_;              ///< Of the backend; empty while it works.
  dtsdf_mapping::MapStatus report_;  ///< What it says of the map.
};

}  // namespace dtsdf
