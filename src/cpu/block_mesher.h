/// Incremental meshing on the CPU: which blocks to mesh again, and the loops around the rules.
#pragma once

#include <vector>

#include "cpu/voxel_store.h"
#include "dtsdf_mapping/kernels/mesh_block.h"
#include "dtsdf_mapping/map/block_table.h"
#include "dtsdf_mapping/mapper/profile.h"
#include "dtsdf_mapping/meshing/block_mesh.h"

namespace dtsdf {

class BlockMesher {
 public:
  BlockMesher(const BlockTable& table, VoxelStore& voxels, bool directional, int threads);

  /// Follows the growth of the table.
  void resize();

  /// The block's voxels changed. Safe to call for different slots from different threads.
  void markDirty(int32_t slot) { state_[slot].dirty = true; }

  /// The block goes away without ever having held anything.
  void forget(int32_t slot) { state_[slot] = SlotState(); }

  void clear();

  void profileTo(Profile* profile) { profile_ = profile; }

  /// Memory of the unit indices and of what is kept for each slot.
  size_t bytes() const;

  /// Meshes what changed since the last call. @return the changed blocks, by packed key.
  std::vector<BlockMesh> update();

 private:
  struct SlotState {
    bool dirty = false;
    bool has_mesh = false;
    std::vector<UnitIndices> indices;  ///< Before regularisation, one per unit; empty: none.
  };

  std::vector<int32_t> takeDirty();

  /// The blocks whose units have a corner in one that changed.
  std::vector<int32_t> reachBlocks();

  /// Forms the blocks' unit indices anew. @return the slots whose indices changed.
  std::vector<int32_t> indexBlocks(const std::vector<int32_t>& slots);

  /// The meshes of blocks, from indices that are up to date around them.
  std::vector<BlockMesh> emitBlocks(const std::vector<int32_t>& slots) const;

  std::vector<int32_t> withNeighbours(const std::vector<int32_t>& slots,
                                      const std::vector<Vec3i>& offsets) const;

  const BlockTable& table_;
  VoxelStore& voxels_;
  bool directional_;
  int threads_;
  std::vector<SlotState> state_;
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
