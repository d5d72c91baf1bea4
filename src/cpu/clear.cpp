#include "cpu/clear.h"

#include <algorithm>

#include "kernels/fusion/free_space.h"

namespace dtsdf {
namespace {

/// Voxels that are judged at once, at most.
constexpr int kBatch = 64;

/// The feet of some of an array's voxels, found side by side: isContradicted()'s way to where a
/// foot is seen, which compilers turn into vector instructions. Same bits.
class FootBatch {
 public:
  VoxelInImage at(int i) const { return {depth_m_[i], u_[i], v_[i]}; }

  void compute(const Voxel* voxels, const int* indices, int count, const Facing& facing,
               const Vec3f& first_voxel_L, const FrameView& view) {
    for (int i = 0; i < count; ++i) gather(voxels, indices[i], i);
    const FrameView frame = view;  // a copy of its own, which no result can overlap
    for (int i = 0; i < count; ++i) {
      const Vec3f foot =
          footOf({x_[i], y_[i], z_[i]}, sdf_[i], {slope_x_[i], slope_y_[i], slope_z_[i]}, facing);
      const VoxelInImage at = projectToImage(frame, first_voxel_L + foot);
      depth_m_[i] = at.depth_m;
      u_[i] = at.u;
      v_[i] = at.v;
    }
  }

 private:
  void gather(const Voxel* voxels, int index, int i) {
    const Vec3f voxel = toFloat(voxelOffset(index)), slope = slopeAt(voxels, index);
    x_[i] = voxel.x;
    y_[i] = voxel.y;
    z_[i] = voxel.z;
    sdf_[i] = sdfOf(voxels[index]);
    slope_x_[i] = slope.x;
    slope_y_[i] = slope.y;
    slope_z_[i] = slope.z;
  }

  float x_[kBatch], y_[kBatch], z_[kBatch], sdf_[kBatch];
  float slope_x_[kBatch], slope_y_[kBatch], slope_z_[kBatch];
  float depth_m_[kBatch], u_[kBatch], v_[kBatch];
};

bool isRowEmpty(const Voxel* row) {
  uint32_t state = 0;
  for (int x = 0; x < kBlockSide; ++x) state |= row[x].state;
  return state == 0;
}

/// Lists the voxels that claim a surface which the frame, by its sums, does not support.
/// @return their number.
int findUnsupported(const Voxel* voxels, const VoxelSums* sums, int (&found)[kVoxelsPerBlock]) {
  int count = 0;
  for (int row = 0; row < kVoxelsPerBlock; row += kBlockSide) {
    if (isRowEmpty(voxels + row)) continue;
    for (int i = row; i < row + kBlockSide; ++i) {
      const bool is_supported = sums != nullptr && sums[i].weight != 0;
      found[count] = i;
      count += static_cast<int>(!isEmpty(voxels[i])) & static_cast<int>(!is_supported);
    }
  }
  return count;
}

/// All voxels are judged before the first one changes: they look at their neighbours.
/// @return the number of voxels that are contradicted.
int findContradicted(const BlockLook& look, int direction, const FrameSensing& sensing,
                     const Voxel* voxels, int (&found)[kVoxelsPerBlock]) {
  const bool has_sums = look.sums != nullptr && (look.directions >> direction & 1);
  const int judged =
      findUnsupported(voxels, has_sums ? look.sums->voxel[direction] : nullptr, found);
  const Facing facing = facingOf(look.directional ? direction : kAnyDirection);
  const Vec3f first_voxel_L = toFloat(firstVoxelOfBlock(look.block_L));
  FootBatch feet;
  int count = 0;
  for (int first = 0; first < judged; first += kBatch) {
    const int batch = std::min(kBatch, judged - first);
    feet.compute(voxels, found + first, batch, facing, first_voxel_L, sensing.image.frame);
    for (int i = 0; i < batch; ++i) {
      if (seesThrough(sensing, feet.at(i))) found[count++] = found[first + i];
    }
  }
  return count;
}

}  // namespace

ClearedBlock clearBlock(const BlockLook& look, const BlockEntry& entry, const FrameSensing& sensing,
                        const FusionRules& rules, VoxelStore& voxels) {
  ClearedBlock result{false, 0};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    Voxel* array = voxels.array(entry.array[d]);
    int found[kVoxelsPerBlock];
    const int count = findContradicted(look, d, sensing, array, found);
    if (count == 0) continue;
    result.changed = true;
    for (int i = 0; i < count; ++i) {
      array[found[i]] = contradictedVoxel(array[found[i]], look.frames, rules);
    }
    if (std::all_of(array, array + kVoxelsPerBlock, isEmpty)) result.empty_directions |= 1u << d;
  }
  return result;
}

}  // namespace dtsdf
