#include "cpu/cast.h"

#include <algorithm>

#include "cpu/widest_vectors.h"
#include "kernels/fusion/voxel_projection.h"

namespace dtsdf {
namespace {

/// The samples of a line on two grid planes of a block, at four corners per plane. They are
/// computed in a loop that compilers vectorise, and equal those of castSurfel() bit for bit.
class PlanePair {
 public:
  static constexpr int kPlanes = 2;

  /// Computes the samples of plane `first` and the next one.
  template <bool kHasSides>
  void compute(const SampleLine& line, const MeasuredSides& sides, const float (&weights)[3],
               const BlockFrame& frame, int first, float sdf_scale) {
    const BlockFrame block = frame;  // a copy, as stores may alias the reference
    const Vec3i shifts = pointShifts(line.axis);
    for (int i = 0; i < kCount; ++i) {
      const int plane = first + (i >> 2), du = i & 1, dv = i >> 1 & 1;
      const CellCrossing crossing = crossCell(line, plane);
      const CornerSample sample = sampleCorner<kHasSides>(line, sides, shifts, crossing, du, dv);
      const int u = crossing.u + du - block.u0, v = crossing.v + dv - block.v0;
      // To avoid unpredictable branches, corners outside the block add weight 0 to a voxel inside.
      constexpr uint32_t kLast = kBlockSide - 1;
      const bool is_held =
          (static_cast<uint32_t>(u) <= kLast) & (static_cast<uint32_t>(v) <= kLast);
      const int index =
          (plane - block.k0) * block.stride_k + u * block.stride_u + v * block.stride_v;
      index_[i] = index & (kVoxelsPerBlock - 1);
      const float share = is_held ? sample.share : 0.0f;
      const int32_t sdf = roundSdf(sample.distance * sdf_scale);
      for (int d = 0; d < 3; ++d) {
        const VoxelSums sums = sumsOfSample(roundWeight(share * weights[d]), sdf, sample.point_key);
        weighted_sdf_[d][i] = sums.weighted_sdf;
        weight_[d][i] = static_cast<int32_t>(sums.weight);
        nearest_[d][i] = sums.nearest;
      }
    }
  }

  /// Adds the samples of the first `planes` planes to the sums of a line's d-th direction.
  void addTo(VoxelSums* sums, int d, int planes) const {
    for (int i = 0; i < 4 * planes; ++i) {
      addToSums(sums[index_[i]], {weighted_sdf_[d][i], weight_[d][i], nearest_[d][i], 0});
    }
  }

 private:
  static constexpr int kCount = 4 * kPlanes;

  int32_t index_[kCount], weight_[3][kCount];
  int64_t weighted_sdf_[3][kCount];
  uint32_t nearest_[3][kCount];
};

/// Adds those samples of a line that lie in a block to the block's sums.
template <bool kHasSides>
void castLine(const StoredLine& kept, const MeasuredSides& sides, const BlockFrame& block,
              float sdf_scale, BlockSums& sums) {
  const SampleLine line = kept.line;
  const Span planes = planesInside({line.first_plane, line.last_plane}, block);
  PlanePair pair;
  for (int first = planes.first; first <= planes.last; first += PlanePair::kPlanes) {
    pair.compute<kHasSides>(line, sides, kept.weight, block, first, sdf_scale);
    const int count = std::min(planes.last - first + 1, PlanePair::kPlanes);
    int d = 0;
    visitDirections(kept.directions,
                    [&](int direction) { pair.addTo(sums.voxel[direction], d++, count); });
  }
}

}  // namespace

void cast(const TouchedBlock& block, const BlockFinder& finder, const FusionSettings& fusion,
          BlockSums& sums) {
  constexpr int kAhead = 6;  // number of lines to prefetch; they are scattered in memory
  withWidestVectors([&] {
    const BlockFrame frames[3] = {blockFrameOf(0, block.block_L), blockFrameOf(1, block.block_L),
                                  blockFrameOf(2, block.block_L)};
    const float sdf_scale = sdfScale(fusion);
    for (const std::vector<uint32_t>* surfels : block.surfels) {
      const uint32_t* const end = surfels->data() + surfels->size();
      for (const uint32_t* i = surfels->data(); i != end; ++i) {
        if (end - i > kAhead) {
          __builtin_prefetch(&finder.line(i[kAhead]));
          __builtin_prefetch(&finder.sides(i[kAhead]));
        }
        const StoredLine& kept = finder.line(*i);
        const BlockFrame& frame = frames[kept.line.axis];
        if (kept.has_sides) {
          castLine<true>(kept, finder.sides(*i), frame, sdf_scale, sums);
        } else {
          castLine<false>(kept, noSides(), frame, sdf_scale, sums);
        }
      }
    }
  });
}

void findCovered(BlockSums& sums, int direction) {
  VoxelSet& covered = sums.covered[direction];
  const VoxelSums* voxel = sums.voxel[direction];
  for (uint64_t& word : covered.word) {
    word = 0;
    for (int row = 0; row < VoxelSet::kWordBits; row += kBlockSide, voxel += kBlockSide) {
      uint32_t bits = 0;
#pragma GCC unroll 8  // shifts by constants
      for (int x = 0; x < kBlockSide; ++x) bits |= (voxel[x].weight != 0 ? 1u : 0u) << x;
      word |= static_cast<uint64_t>(bits) << row;
    }
  }
}

void project(const TouchedBlock& block, const std::vector<Surfel>& surfels, const FrameView& frame,
             const FusionSettings& fusion, BlockSums& sums) {
  for (int index = 0; index < kVoxelsPerBlock; ++index) {
    auto add = [&](int direction, int32_t weight, int32_t sdf, uint32_t point_key) {
      addToSums(sums.voxel[direction][index], weight, sdf, point_key);
    };
    projectVoxel(frame, fusion, surfels.data(),
                 firstVoxelOfBlock(block.block_L) + voxelOffset(index), add);
  }
}

}  // namespace dtsdf
