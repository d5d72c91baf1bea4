/// The voxel arrays of a block of the map and of those around it, as the rules of the mesh ask for
/// them.
#pragma once

#include "cpu/voxel_store.h"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/possible_leaders.h"
#include "map/block_table.h"

namespace dtsdf {

/// The voxels at a corner, by direction.
struct VoxelsAt {
  const Voxel* const* array;  ///< Null where there is none.
  int voxel;

  uint16_t anchor(int direction) const {
    return array[direction] == nullptr ? kNoAnchor : array[direction][voxel].anchor;
  }
  uint16_t outline(int direction) const {
    return array[direction] == nullptr ? 0 : array[direction][voxel].outline;
  }
};

/// Blocks are looked up when they are first asked for: only edges and normals at the block's lower
/// faces ask for those below. For one thread, while the map does not change.
class NearbyArrays {
 public:
  NearbyArrays(const BlockTable& table, const VoxelStore& voxels, const BlockKey& key,
               int32_t least_evidence);

  /// By direction, null where there is none; of the block at an offset in {-1, 0, 1}^3.
  const Voxel* const* at(const Vec3i& offset) const { return find(aroundNumber(offset)); }

  int32_t leastEvidence() const { return arrays_.least_evidence; }

  /// The sample at a corner, each coordinate in [-8, 16).
  Sample sample(const Vec3i& corner, int direction) const {
    find(blockAround(corner));
    return arrays_.sample(corner, direction);
  }
  VoxelsAt voxelsAt(const Vec3i& corner) const {
    constexpr int kMask = kBlockSide - 1;
    return {find(blockAround(corner)),
            voxelIndex(corner.x & kMask, corner.y & kMask, corner.z & kMask)};
  }
  Sample sample(int corner, int direction) const { return sample(cornerAt(corner), direction); }

  /// How a corner of the grid is seen by all directions, see sidesOfSample().
  uint32_t sides(int corner) const {
    const VoxelsAt at = voxelsAt(cornerAt(corner));
    uint32_t sides = 0;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (at.array[d] == nullptr) continue;
      const Sample seen = sampleOf(at.array[d][at.voxel], leastEvidence());
      sides |= sidesOfSample(d, seen.sdf, seen.weight);
    }
    return sides;
  }

 private:
  const Voxel* const* find(int n) const {
    if (!(found_ >> n & 1)) lookUp(n);
    return arrays_.array[n];
  }
  void lookUp(int n) const;

  const BlockTable& table_;
  const VoxelStore& voxels_;
  const BlockKey key_;
  mutable uint32_t found_ = 0;  ///< Bit n: block number n has been looked up.
  mutable ArraysAround arrays_;
};

}  // namespace dtsdf
