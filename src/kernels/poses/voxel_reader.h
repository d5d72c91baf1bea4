/// Looks up voxels of a map by position, for rules that read many voxels near each other.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"

namespace dtsdf {

/// `find(key)` returns the slot of a block from its packed key, or -1; `arrayOf(slot, direction)`
/// returns a voxel array, or null. The last block is remembered, as the next voxel is usually in
/// the same block.
template <class Find, class ArrayOf>
class VoxelReader {
 public:
  DTSDF_HD VoxelReader(const Vec3i& origin_voxel, const Find& find, const ArrayOf& arrayOf)
      : origin_(origin_voxel), find_(find), arrayOf_(arrayOf) {}

  DTSDF_HD Voxel operator()(int direction, const Vec3i& at_L) {
    const Vec3i at = at_L + origin_;
    const BlockKey key = blockOfVoxel(at);
    if (!is_known_ || key != key_) {
      slot_ = isRepresentable(key) ? find_(packKey(key)) : -1;
      key_ = key;
      is_known_ = true;
    }
    const Voxel* const voxels = slot_ < 0 ? nullptr : arrayOf_(slot_, direction);
    return voxels == nullptr ? makeVoxel(0.0f, 0, 0) : voxels[indexInBlock(at)];
  }

 private:
  Vec3i origin_;
  Find find_;
  ArrayOf arrayOf_;
  BlockKey key_{0, 0, 0};
  int32_t slot_ = -1;
  bool is_known_ = false;
};

}  // namespace dtsdf
