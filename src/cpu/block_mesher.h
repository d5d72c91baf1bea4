/// Incremental meshing on the CPU: selects the blocks to mesh again, and meshes them.
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

  /// Allocates the states of `slots` slots. @throws std::bad_alloc
  void resize(size_t slots) {
    if (state_.size() < slots) state_.resize(slots);
  }

  /// Call this when voxels of the block change.
  void markDirty(int32_t slot) {
    if (!state_[slot].dirty) dirty_.push_back(slot);
    state_[slot].dirty = true;
    state_[slot].changed = indexings_;
  }
  void markAllDirty();

  /// From the next update() on, all meshes contain colours.
  void keepColours();

  /// Call this when only colours of the block change.
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

  /// Slots with marks, without duplicates.
  std::vector<int32_t> marked() const;
  MeshMarks marksOf(int32_t slot) const { return {state_[slot].dirty, state_[slot].painted}; }
  MeshMarks takeMarks(int32_t slot);
  void setMarks(int32_t slot, const MeshMarks& marks);

  /// Removes and returns the states of blocks that are being evicted.
  MeshStates takeStates(const std::vector<int32_t>& slots);
  /// Restores the states of blocks that are being loaded again.
  void restoreStates(const std::vector<int32_t>& slots, const MeshStates& states);

  size_t bytes() const;

  /// Meshes the blocks that were marked since the last call, and the blocks around them. Voxels
  /// with less evidence than `min_evidence` count as unknown. @return the meshes sorted by packed
  /// key, without those that were empty and still are.
  MeshUpdate update(int32_t min_evidence);

  /// Updates outdated labels. Does not clear marks.
  void labelBlocks(std::vector<int32_t> slots, int32_t min_evidence);

  /// The unrefined mesh of a block, cached until it changes; null if there is none. Thread-safe for
  /// different blocks and surfaces. @pre labelBlocks() was called for the block and its neighbours.
  const BlockMesh* viewMesh(int32_t slot, BlockSurface& surface);

 private:
  struct SlotState {
    bool dirty = false, painted = false;
    bool has_mesh = false;
    uint32_t update = 0;  ///< Value of update_ when the block was last selected.
    /// Values of indexings_ when voxels, colours, labels and `shown` were last written.
    uint64_t changed = 0, repainted = 0, indexed = 0, made = 0;
    int32_t min_evidence = 0;                ///< Minimum evidence used for the labels.
    std::vector<UnitLabels> labels;          ///< One per unit; empty if all units are empty.
    std::vector<BlockVertex> vertices;       ///< On edges that surfaces cross; for updates only.
    std::vector<Vec3f> normals;              ///< One per vertex, if meshes are refined.
    std::unique_ptr<const BlockMesh> shown;  ///< For viewMesh(); null if empty or not yet computed.
  };

  static size_t bytesOf(const std::vector<UnitLabels>& labels) {
    return labels.capacity() * sizeof(UnitLabels);
  }
  static size_t bytesOf(const BlockMesh* mesh);

  void dropClearedMarks(std::vector<int32_t>& list, bool SlotState::*mark);

  /// Adds the block to `slots` if it exists and this update has not selected it yet.
  void select(const BlockKey& key, std::vector<int32_t>& slots);

  /// Whether a block's labels are out of date.
  bool areLabelsOutdated(int32_t slot) const;

  /// Whether a block's `shown` is out of date.
  bool isShownMeshOutdated(int32_t slot) const;

  /// Computes a block's mesh without colours. @return false if all its units are empty.
  bool makeSurface(int32_t slot, BlockSurface& surface, bool refined, BlockMesh& mesh) const;
  std::vector<VertexColour> coloursOf(const BlockMesh& mesh) const {
    if (!has_colours_) return {};
    return vertexColours(colouredCorners(map_, mesh.key, min_evidence_), mesh.vertices,
                         directional_);
  }
  void show(int32_t slot, std::unique_ptr<const BlockMesh> mesh);

  /// Updates labels and vertices of those blocks whose labels are out of date.
  void indexBlocks(std::vector<int32_t> slots, bool with_vertices);

  /// Selects the blocks at offset(0) to offset(count - 1) from each changed block, and sorts all
  /// selected blocks by key.
  void selectAround(const std::vector<int32_t>& changed, int count, Vec3i (*offset)(int),
                    std::vector<int32_t>& slots);

  /// Returns all meshes to report: those that are not empty, or were not before.
  std::vector<BlockMesh> takeChanges(const std::vector<int32_t>& slots,
                                     std::vector<BlockMesh>& meshes);

  void sortByKey(std::vector<int32_t>& slots) const;

  /// Computes the meshes of blocks. @pre Labels of the blocks and their neighbours are up to date.
  std::vector<BlockMesh> makeMeshes(const std::vector<int32_t>& slots);

  /// Whether makeMeshes() will probably read many of a block's voxels.
  bool willReadVoxels(int32_t slot) const;

  const CpuMap& map_;
  const BlockTable& table_;
  MeshSettings rules_;
  bool directional_;
  int threads_;
  bool refined_;
  std::vector<SlotState> state_;
  /// Slots that were marked. Some may have lost the mark or their block since.
  std::vector<int32_t> dirty_, painted_;
  std::atomic<size_t> held_bytes_{0};  ///< Memory of all slots' labels and shown meshes.
  uint32_t update_ = 0;                ///< Counts the calls to update().
  uint64_t indexings_ = 0;             ///< Counts the calls to indexBlocks().
  int32_t min_evidence_ = 0;
  bool has_colours_ = false;    ///< See keepColours().
  bool renders_views_ = false;  ///< If views were rendered, updates also maintain `shown`.
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
