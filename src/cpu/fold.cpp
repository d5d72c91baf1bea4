#include <algorithm>

#include "cpu/cast.h"
#include "cpu/widest_vectors.h"
#include "kernels/fusion/voxel_update.h"

namespace dtsdf {
namespace {

/// A batch of voxels of one array with their sums, folded in a loop that compilers vectorise.
class FoldBatch {
 public:
  static constexpr int kVoxels = 32;

  bool isFull() const { return count_ == kVoxels; }

  /// Adds a voxel and its sums to the batch, and resets the sums to zero.
  void take(VoxelSums* sums, const Voxel* voxels, int index) {
    const Voxel& voxel = voxels[index];
    const RoundedSums rounded = roundSums(sums[index]);
    sums[index] = {};
    const int i = count_++;
    index_[i] = index;
    sdf_units_[i] = voxel.sdf_units;
    anchor_[i] = voxel.anchor;
    state_[i] = voxel.state;
    weighted_sdf_[i] = rounded.weighted_sdf;
    weight_[i] = rounded.weight;
    dither_[i] = rounded.dither;
    nearest_[i] = rounded.nearest;
  }

  /// Folds the sums into the voxels, stores the voxels in their array, and empties the batch.
  void foldInto(Voxel* voxels, float depth_weight, const FusionSettings& fusion) {
    withWidestVectors([&] { compute(depth_weight, fusion); });
    for (int i = 0; i < count_; ++i) voxels[index_[i]] = voxelAt(i);
    count_ = 0;
  }

 private:
  static constexpr int kTogether = 8;

  Voxel voxelAt(int i) const {
    return {static_cast<int16_t>(sdf_units_[i]), static_cast<uint16_t>(anchor_[i]), state_[i]};
  }

  /// Processes whole groups of kTogether voxels. The last group may be padded with voxels of
  /// earlier batches, whose results are not used.
  void compute(float depth_weight, const FusionSettings& settings) {
    const FusionSettings fusion = settings;  // a copy, as stores may alias the reference
    const int count = (count_ + kTogether - 1) / kTogether * kTogether;
    for (int i = 0; i < count; ++i) {
      const RoundedSums sums{weighted_sdf_[i], weight_[i], dither_[i], nearest_[i]};
      const Voxel folded = foldRoundedSums(voxelAt(i), sums, depth_weight, fusion);
      sdf_units_[i] = folded.sdf_units;
      anchor_[i] = folded.anchor;
      state_[i] = folded.state;
    }
  }

  int count_ = 0;
  int32_t index_[kVoxels], sdf_units_[kVoxels] = {}, anchor_[kVoxels] = {};
  uint32_t state_[kVoxels] = {};
  float weighted_sdf_[kVoxels] = {}, weight_[kVoxels] = {}, dither_[kVoxels] = {};
  uint32_t nearest_[kVoxels] = {};
};

/// Folds sums into an array. @return whether any of its voxels has a distance afterwards.
bool foldArray(VoxelSums* sums, const VoxelSet& covered, float depth_weight,
               const FusionSettings& fusion, Voxel* voxels) {
  FoldBatch batch;
  covered.forEach([&](int i) {
    batch.take(sums, voxels, i);
    if (batch.isFull()) batch.foldInto(voxels, depth_weight, fusion);
  });
  batch.foldInto(voxels, depth_weight, fusion);
  return !std::all_of(voxels, voxels + kVoxelsPerBlock, isEmpty);
}

}  // namespace

uint32_t fold(BlockSums& sums, uint32_t directions, const BlockEntry& entry, float depth_weight,
              const FusionSettings& fusion, VoxelStore& voxels) {
  uint32_t empty = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(directions >> d & 1)) continue;
    const int32_t array = entry.array[d];
    if (array == kNoArray) {
      std::fill_n(sums.voxel[d], kVoxelsPerBlock, VoxelSums{});
      continue;
    }
    findCovered(sums, d);
    const bool observed =
        foldArray(sums.voxel[d], sums.covered[d], depth_weight, fusion, voxels.array(array));
    if (!observed) empty |= 1u << d;
  }
  return empty;
}

}  // namespace dtsdf
