/// Incremental meshing on the device: which blocks to mesh again, and their meshes.
#pragma once

#include <vector>

#include "backend/profile.h"
#include "device_map.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/mesh_block.h"

namespace dtsdf {
namespace gpu {

/// Counts of one extraction.
struct MeshCounters {
  uint32_t reached;    ///< Blocks whose units have a corner in a changed block.
  uint32_t adjoining;  ///< Further blocks, across a face of one whose indices changed.
};

/// Space that the meshes take, whether they could be written or not.
struct MeshSize {
  uint32_t vertices, triangles;
};

/// All that the host has to know of an extraction.
struct MeshTotals {
  MeshCounters blocks;
  MeshSize size;
};

/// Where the mesh of one block lies.
struct MeshRecord {
  PackedKey key;
  int32_t slot;
  uint32_t first_vertex, vertices;
  uint32_t first_triangle, triangles;
  uint32_t unused;  ///< In place of padding, whose bytes nothing would write.
};

/// Triangle of three 16-bit indices into the block's vertices.
struct BlockTriangle {
  uint16_t vertex[3];
};

/// What kernels need of an extraction, by value.
struct MeshView {
  const MeshTables* tables;
  MeshCounters* counters;
  MeshSize* size;
  int32_t* slots;  ///< First the reached blocks, then the adjoining ones.
  MeshRecord* records;  ///< One per block of `slots`.
  BlockVertex* vertices;
  BlockTriangle* triangles;
  MeshSize capacity;
  uint32_t stamp;  ///< Number of this extraction.
  int32_t directional;
};

/// One extraction at a time, on a stream of its own beside the frames: begin() enqueues everything
/// up to the meshes on the device, settle() makes sure that they are complete and enqueues their
/// way to the host, finish() waits for them there.
class BlockMesher {
 public:
  explicit BlockMesher(bool directional);
  ~BlockMesher() { stream_.drain(); }

  /// Enqueues an extraction of what changed up to the event: `most_dirty` blocks at most.
  void begin(const MapView& map, const Event& map_ready, size_t most_dirty);
  bool isUnderWay() const { return state_ != State::kIdle; }
  void setClock(StageClock* clock) { stream_.setClock(clock); }
  void addMemory(std::vector<MemoryPart>& parts) const;

  /// To be called before the map changes: waits until an extraction under way has read what it
  /// needs. Fetching the meshes goes on beside what follows.
  void settle();

  /// Waits for the extraction. @return its changes; empty if none was begun.
  MeshUpdate finish();

 private:
  enum class State { kIdle, kBegun, kSettled };

  MeshView view() const;
  void indexBlocks();
  void enqueueMeshes();
  void count() const;
  void fetch();
  size_t recordCount() const {
    return pinned_totals_[0].blocks.reached + pinned_totals_[0].blocks.adjoining;
  }
  std::vector<MeshRecord> changedRecords();
  BlockMesh copyBlock(const MeshRecord& record) const;

  bool directional_;
  int thread_blocks_;  ///< That fill the device, for kernels whose work is counted there.
  Stream stream_;
  Event begun_{Timing::kOn}, fetched_{Timing::kOn}, counted_;
  State state_ = State::kIdle;
  MapView map_ = {};
  uint32_t stamp_ = 0;
  DeviceBuffer<MeshTables> tables_;
  DeviceBuffer<MeshTotals> totals_;
  PinnedBuffer<MeshTotals> pinned_totals_;
  DeviceBuffer<int32_t> slots_;
  DeviceBuffer<MeshRecord> records_;
  DeviceBuffer<BlockVertex> vertices_;
  DeviceBuffer<BlockTriangle> triangles_;
  PinnedBuffer<MeshRecord> pinned_records_;
  PinnedBuffer<BlockVertex> pinned_vertices_;
  PinnedBuffer<BlockTriangle> pinned_triangles_;
  std::vector<uint8_t> has_mesh_;  ///< Per slot: the last mesh that was handed out has triangles.
};

}  // namespace gpu
}  // namespace dtsdf
