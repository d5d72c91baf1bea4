/// Incremental meshing on the CPU: selects the blocks to mesh again, and runs the rules over them.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "backend/map_backend.h"
#include "backend/profile.h"
#include "cpu/block_surface.h"
#include "cpu/vertex_colours.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/meshing/unit_samples.h"
#include "map/block_table.h"

namespace dtsdf {

class BlockMesher {
 public:
  BlockMesher(const CpuMap& map, const MeshSettings& rules, bool directional, int threads,
              bool refined);

  /// Makes room for the states of `slots` slots. @throws std::bad_alloc
  void resize(size_t slots) {
    if (state_.size() < slots) state_.resize(slots);
  }

  /// Call this when the block's voxels change.
  void markDirty(int32_t slot) {
    if (!state_[slot].dirty) dirty_.push_back(slot);
    state_[slot].dirty = true;
    state_[slot].changed = indexings_;
  }
  void markAllDirty();

  /// From now on, all meshes have colours.
  void keepColours();

  /// Call this when colours of the block change; its vertices stay as they are.
  void markPainted(int32_t slot) {
    if (!state_[slot].painted) painted_.push_back(slot);
    state_[slot].painted = true;
    state_[slot].repainted = indexings_;
  }

  /// Call this when the block is removed.
  void forget(int32_t slot) {
    held_bytes_ -= bytesOf(state_[slot].labels) + bytesOf(state_[slot].shown.get());
    state_[slot] = SlotState();
  }

  void profileTo(Profile* profile) { profile_ = profile; }

  /// Slots with marks, each once.
  std::vector<int32_t> marked() const;
  MeshMarks marksOf(int32_t slot) const { return {state_[slot].dirty, state_[slot].painted}; }
  MeshMarks takeMarks(int32_t slot);
  void setMarks(int32_t slot, const MeshMarks& marks);

  /// Takes the states of blocks that leave memory, or enters those of blocks that return.
  MeshStates takeStates(const std::vector<int32_t>& slots);
  void restoreStates(const std::vector<int32_t>& slots, const MeshStates& states);

  /// Memory of the units' labels and the state of each slot.
  size_t bytes() const;

  /// Meshes the blocks that were marked since the last call. @return the changed blocks, by packed
  /// key. Voxels with less than `min_evidence` count as unknown.
  MeshUpdate update(int32_t min_evidence);

  /// Updates the labels of blocks, as the next update() would; marks stay.
  void labelBlocks(std::vector<int32_t> slots, int32_t min_evidence);

  /// The unrefined mesh of a block; null if it has none. It is cached until it changes. Thread-safe
  /// for different blocks and surfaces.
  /// @pre labelBlocks() was called for the block and those around it.
  const BlockMesh* viewMesh(int32_t slot, BlockSurface& surface);

 private:
  struct SlotState {
    bool dirty = false, painted = false;
    bool has_mesh = false;
    uint32_t update = 0;  ///< Number of the latest update() that selected the block.
    /// Value of indexings_ when voxels, colours, labels and `shown` last changed.
    uint64_t changed = 0, repainted = 0, indexed = 0, made = 0;
    int32_t min_evidence = 0;                ///< Minimum evidence that the labels were made with.
    std::vector<UnitLabels> labels;          ///< One per unit; empty if all are.
    std::vector<BlockVertex> vertices;       ///< On the sheets' edges, during an update only.
    std::vector<Vec3f> normals;              ///< One per vertex, if meshes are refined.
    std::unique_ptr<const BlockMesh> shown;  ///< See viewMesh(); null: none or not made yet.
  };

  static size_t bytesOf(const std::vector<UnitLabels>& labels) {
    return labels.capacity() * sizeof(UnitLabels);
  }
  static size_t bytesOf(const BlockMesh* mesh);

  void dropClearedMarks(std::vector<int32_t>& list, bool SlotState::*mark);

  /// Adds the block to this update's slots, if it exists and was not added before.
  void select(const BlockKey& key, std::vector<int32_t>& slots);

  /// Whether voxels that a block's labels depend on changed since these were made.
  bool isStale(int32_t slot) const;

  /// Whether labels or colours that a block's shown mesh depends on changed since it was made.
  bool isOutdated(int32_t slot) const;

  /// Makes the mesh of a block without colours. @return whether it has a surface.
  bool makeSurface(int32_t slot, BlockSurface& surface, bool refined, BlockMesh& mesh) const;
  std::vector<VertexColour> coloursOf(const BlockMesh& mesh) const {
    if (!has_colours_) return {};
    return vertexColours(colouredCorners(map_, mesh.key, min_evidence_), mesh.vertices,
                         directional_);
  }
  void show(int32_t slot, std::unique_ptr<const BlockMesh> mesh);

  /// The index stage, for blocks whose labels are stale.
  void indexBlocks(std::vector<int32_t> slots, bool with_vertices);

  /// Adds the blocks at `count` offsets around those that changed, and sorts all by key.
  void selectAround(const std::vector<int32_t>& changed, int count, Vec3i (*offset)(int),
                    std::vector<int32_t>& slots);

  /// The meshes to report: all but those that were empty and still are.
  std::vector<BlockMesh> takeChanges(const std::vector<int32_t>& slots,
                                     std::vector<BlockMesh>& meshes);

  void sortByKey(std::vector<int32_t>& slots) const;

  /// The make stage. @pre The labels around the blocks are up to date.
  std::vector<BlockMesh> makeMeshes(const std::vector<int32_t>& slots);

  /// Whether makeMeshes() will read a block's voxels.
  bool makingReadsVoxels(int32_t slot) const;

  const CpuMap& map_;
  const BlockTable& table_;
  MeshSettings rules_;
  bool directional_;
  int threads_;
  bool refined_;
  std::vector<SlotState> state_;
  /// Slots with these marks; their blocks may have been removed since.
  std::vector<int32_t> dirty_, painted_;
  std::atomic<size_t> held_bytes_{0};  ///< Memory of all slots' labels and shown meshes.
  uint32_t update_ = 0;                ///< Number of the latest update().
  uint64_t indexings_ = 0;
  int32_t min_evidence_ = 0;
  bool has_colours_ = false;    ///< Something was painted.
  bool renders_views_ = false;  ///< Views are rendered: updates keep meshes for them.
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
