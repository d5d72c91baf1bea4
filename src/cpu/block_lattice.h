/// The samples at the corners of a block's mesh units, and the units' indices.
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/voxel_store.h"
#include "dtsdf_mapping/kernels/mesh_block.h"
#include "dtsdf_mapping/map/block_table.h"

namespace dtsdf {

/// The voxel arrays that the corners of a block's units lie in; null where there is none.
struct LatticeArrays {
  const Voxel* array[kLatticeBlocks][kDirectionCount];
  uint32_t present;  ///< Bit d: some of the blocks has an array of direction d.

  void find(const BlockTable& table, const VoxelStore& voxels, const BlockKey& key);
};

/// Room for indexing one block after the other; one per thread.
class BlockIndexer {
 public:
  /// Indices of the block's units, before regularisation. @return empty where there is no surface.
  std::vector<UnitIndices> index(const BlockTable& table, const VoxelStore& voxels,
                                 const BlockKey& key, bool directional);

 private:
  /// With room behind the last corner for the last one's neighbours, so that loops need no cases.
  static constexpr int kRoom = kLatticeCorners + kLatticeSide * kLatticeSide;

  void collect(const LatticeArrays& arrays);
  void markSides();
  void findCandidates();
  bool indexRow(int first_corner, bool directional, UnitIndices* row);

  uint32_t present_ = 0;
  float sdf_[kDirectionCount][kLatticeCorners] = {};
  float weight_[kDirectionCount][kLatticeCorners] = {};
  uint32_t sides_[kRoom] = {};          ///< Per corner, see sidesOf().
  uint32_t unit_sides_[kRoom] = {};     ///< Of all corners of the unit that starts at a corner.
  uint8_t candidate_[kLatticeCorners];  ///< Whether that unit can hold a surface.
};

}  // namespace dtsdf
