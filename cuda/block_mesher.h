/// Incremental meshing on the device: room for it, its stages in turn, and the way to the host.
#pragma once

#include <utility>
#include <vector>

#include "backend/map_backend.h"
#include "backend/profile.h"
#include "dtsdf_mapping/block_mesh.h"
#include "mesh_kernels.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// One extraction at a time, on a stream of its own beside the frames: begin() enqueues everything
/// up to the meshes on the device, complete() waits for them and enqueues their way to the host,
/// finish() waits for them there.
class BlockMesher {
 public:
  BlockMesher(const MeshSettings& rules, bool directional, bool refined);
  ~BlockMesher() { stream_.drain(); }

  /// Enqueues what an extraction needs that the map has no part in, while the device is busy with
  /// a frame. @pre None is under way, or it is complete.
  void prepare();

  /// Enqueues an extraction of what changed up to the event: so many blocks at most have other
  /// voxels, or other colours. @param least_evidence That a voxel needs to be known.
  void begin(const MapView& map, const Event& map_ready, size_t most_dirty, size_t most_painted,
             int32_t least_evidence);
  void setClock(StageClock* clock) { stream_.setClock(clock); }
  void addMemory(std::vector<MemoryPart>& parts) const;

  /// To be called before the map changes: waits until an extraction under way has read what it
  /// needs. Fetching the meshes goes on beside what follows.
  void complete();

  /// Waits for the extraction. @return its changes; none if none was begun.
  MeshUpdate finish();

  /// Whether an extraction may still read the map.
  bool isUnderWay() const { return state_ == State::kBegun; }

  /// Whether what was unchanged at the last extraction has labels for so much evidence.
  bool hasLabelled(int32_t least_evidence) const {
    return stamp_ > 0 && least_evidence_ == least_evidence;
  }

  /// Whether the last mesh of a slot's block that was handed out has triangles: taken of one that
  /// leaves, and set of one that is back.
  bool takeHasMesh(int32_t slot) { return std::exchange(hasMesh(slot), uint8_t{0}) != 0; }
  void setHasMesh(int32_t slot, bool has_mesh) { hasMesh(slot) = has_mesh; }

 private:
  enum class State { kIdle, kBegun, kComplete };

  MeshView view();
  void enqueueIndices();
  void enqueueMeshes();
  bool hasColours() const { return map_.colour_of != nullptr; }
  void fetch();
  uint8_t& hasMesh(int32_t slot);
  size_t recordCount() const {
    return pinned_totals_[0].blocks.reached + pinned_totals_[0].blocks.adjoining;
  }
  std::vector<MeshRecord> changedRecords();
  BlockMesh copyBlock(const MeshRecord& record) const;
  std::vector<BlockMesh> copyBlocks(const std::vector<MeshRecord>& records) const;

  MeshSettings rules_;
  bool directional_, refined_;
  int thread_blocks_;  ///< That fill the device, for kernels whose work is counted there.
  Stream stream_;
  Event begun_{Timing::kOn}, fetched_{Timing::kOn}, counted_;
  State state_ = State::kIdle;
  bool is_prepared_ = false;
  MapView map_ = {};
  uint32_t stamp_ = 0;
  int32_t least_evidence_ = 0;
  DeviceBuffer<MeshTotals> totals_;
  PinnedBuffer<MeshTotals> pinned_totals_;  ///< A kernel writes them there.
  DeviceBuffer<int32_t> slots_;
  DeviceBuffer<MeshRecord> records_;
  DeviceBuffer<BlockVertex> vertices_;
  DeviceBuffer<Vec3f> normals_;  ///< As many as vertices, where meshes are refined.
  DeviceBuffer<BlockTriangle> triangles_;
  PinnedBuffer<MeshRecord> pinned_records_;
  PinnedBuffer<BlockVertex> pinned_vertices_;
  PinnedBuffer<BlockTriangle> pinned_triangles_;
  DeviceBuffer<VertexColour> colours_;  ///< As many as vertices, once something is painted.
  PinnedBuffer<VertexColour> pinned_colours_;
  std::vector<uint8_t> has_mesh_;  ///< Per slot: the last mesh that was handed out has triangles.
};

}  // namespace gpu
}  // namespace dtsdf
