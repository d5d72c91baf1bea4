/// Incremental meshing on the CPU: which blocks to mesh again, and the loops around the rules.
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

  /// Makes room for the states of so many slots. @throws std::bad_alloc
  void resize(size_t slots) {
    if (state_.size() < slots) state_.resize(slots);
  }

  /// The block's voxels changed.
  void markDirty(int32_t slot) {
    if (!state_[slot].dirty) dirty_.push_back(slot);
    state_[slot].dirty = true;
    state_[slot].changed = indexings_;
  }
  void markAllDirty();

  /// From now on, all meshes have colours.
  void keepColours();

  /// Colours of the block changed: vertices stay as they are, but not their colours.
  void markPainted(int32_t slot) {
    if (!state_[slot].painted) painted_.push_back(slot);
    state_[slot].painted = true;
    state_[slot].repainted = indexings_;
  }

  /// The block has gone.
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

  /// What is known of blocks that leave, which is forgotten, and of blocks that are back.
  MeshStates takeStates(const std::vector<int32_t>& slots);
  void enterStates(const std::vector<int32_t>& slots, const MeshStates& states);

  /// Memory of the units' labels and of what is kept for each slot.
  size_t bytes() const;

  /// Meshes what was marked since the last call. @return the changed blocks, by packed key.
  /// `least_evidence` is what a voxel needs to be known.
  MeshUpdate update(int32_t least_evidence);

  /// Brings the labels of blocks up to date, as the next update would; marks stay.
  void labelBlocks(std::vector<int32_t> slots, int32_t least_evidence);

  /// The mesh of a block without refinement; null: none. It is kept until it changes. For several
  /// threads, each with a surface and blocks of its own.
  /// @pre labelBlocks() had the block and those around it.
  const BlockMesh* shownMesh(int32_t slot, BlockSurface& surface);

 private:
  struct SlotState {
    bool dirty = false, painted = false;
    bool has_mesh = false;
    uint32_t update = 0;  ///< Number of the latest update that selected the block.
    /// Voxels, colours, labels and `shown` are as they came to be after so many indexings.
    uint64_t changed = 0, repainted = 0, indexed = 0, made = 0;
    int32_t least_evidence = 0;              ///< What the labels were made with.
    std::vector<UnitLabels> labels;          ///< One per unit; empty: none says anything.
    std::vector<BlockVertex> vertices;       ///< On the sheets' edges, during an update only.
    std::vector<Vec3f> normals;              ///< One per vertex, where meshes are refined.
    std::unique_ptr<const BlockMesh> shown;  ///< See shownMesh(); null: none, or not yet.
  };

  static size_t bytesOf(const std::vector<UnitLabels>& labels) {
    return labels.capacity() * sizeof(UnitLabels);
  }
  static size_t bytesOf(const BlockMesh* mesh);

  void forgetTakenMarks(std::vector<int32_t>& list, bool SlotState::*mark);

  /// Enters the block, if there is one, into this update's slots, unless it is there.
  void select(const BlockKey& key, std::vector<int32_t>& slots);

  /// Whether voxels that a block's labels depend on changed since these were made.
  bool isStale(int32_t slot) const;

  /// Whether labels or colours that a block's shown mesh depends on changed since it was made.
  bool isOutdated(int32_t slot) const;

  /// The mesh of a block without colours. @return whether it has a surface.
  bool makeSurface(int32_t slot, BlockSurface& surface, bool refined, BlockMesh& mesh) const;
  std::vector<VertexColour> coloursOf(const BlockMesh& mesh) const {
    if (!has_colours_) return {};
    return vertexColours(colouredCorners(map_, mesh.key, least_evidence_), mesh.vertices,
                         directional_);
  }
  void show(int32_t slot, std::unique_ptr<const BlockMesh> mesh);

  /// The index stage, of those whose labels are stale.
  void indexBlocks(std::vector<int32_t> slots, bool with_vertices);

  /// Enters the blocks at so many offsets around those that changed. In the order of keys then.
  void selectAround(const std::vector<int32_t>& changed, int count, Vec3i (*offset)(int),
                    std::vector<int32_t>& slots);

  /// What of the meshes is new: all but those that were empty and still are.
  std::vector<BlockMesh> takeChanges(const std::vector<int32_t>& slots,
                                     std::vector<BlockMesh>& meshes);

  void sortByKey(std::vector<int32_t>& slots) const;

  /// The make stage, from labels that are up to date around the blocks.
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
  std::vector<int32_t> dirty_, painted_;  ///< Slots so marked; blocks may have gone since.
  std::atomic<size_t> held_bytes_{0};     ///< Memory of all slots' labels and shown meshes.
  uint32_t update_ = 0;                   ///< Number of the latest update.
  uint64_t indexings_ = 0;
  int32_t least_evidence_ = 0;
  bool has_colours_ = false;  ///< Something was painted.
  bool shows_ = false;        ///< Views were asked for: updates keep meshes for them.
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
