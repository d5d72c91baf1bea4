#include "cpu/cast.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include "cpu/widest_vectors.h"
#include "kernels/fusion/voxel_projection.h"

namespace dtsdf {
namespace {

/// Planes of any lines along one axis, all of subpixels or none, worked out side by side, which
/// compilers turn into vector instructions. Same bits as castIntoBlock().
template <bool kHasSides>
class PlaneBatch {
 public:
  static constexpr int kPlanes = 8;

  bool isFull() const { return count_ == kPlanes; }

  /// Takes of a line's planes as many as fit. @return how many these are.
  int enter(const KeptLine& line, const MeasuredSides& sides, const Span& planes) {
    const int count = std::min(planes.last - planes.first + 1, kPlanes - count_);
    for (int i = 0; i < count; ++i) line_[count_ + i] = &line;
    for (int i = 0; i < kPlanes; ++i) plane_[count_ + i] = planes.first + i;
    fill(per_reach_, line.per_reach);
    fill(p_k_, line.p_k);
    fill(p_u_, line.p_u);
    fill(p_v_, line.p_v);
    fill(slope_u_, line.slope_u);
    fill(slope_v_, line.slope_v);
    fill(normal_k_, line.normal_k);
    fill(normal_u_, line.normal_u);
    fill(normal_v_, line.normal_v);
    for (int d = 0; d < 3; ++d) fill(weight_[d], line.weight[d]);
    if (kHasSides) enterSides(sides);
    count_ += count;
    return count;
  }

  /// Adds the planes that were entered to the sums of a block, and forgets them.
  void addTo(const BlockFrame& block, int axis, float sdf_scale, BlockSums& sums) {
    if (count_ == 0) return;
    compute(axis, sdf_scale);
    placeIn(block);
    for (int i = 0; i < count_; ++i) addPlane(i, sums);
    count_ = 0;
  }

 private:
  /// A value per plane, with room for those that do not fit.
  using PerPlane = float[2 * kPlanes];

  /// Of the next planes, as many as there may be: a loop of fixed length, and the next line's
  /// follow over those that are too many.
  void fill(PerPlane& values, float value) {
    for (int i = 0; i < kPlanes; ++i) values[count_ + i] = value;
  }

  void enterSides(const MeasuredSides& sides) {
    const float values[kSideValues] = {sides.across.x,   sides.across.y, sides.across.z,
                                       sides.down.x,     sides.down.y,   sides.down.z,
                                       sides.per_across, sides.per_down};
    for (int k = 0; k < kSideValues; ++k) fill(sides_[k], values[k]);
  }

  MeasuredSides sidesAt(int i) const {
    return {{sides_[0][i], sides_[1][i], sides_[2][i]},
            {sides_[3][i], sides_[4][i], sides_[5][i]},
            sides_[6][i],
            sides_[7][i]};
  }

  void addPlane(int i, BlockSums& sums) const {
    const KeptLine& line = *line_[i];
    for (int d = 0; d < line.direction_count; ++d) {
      VoxelSums* const of_direction = sums.voxel[line.direction[d]];
      for (int corner = 0; corner < 4; ++corner) {
        addToSums(of_direction[index_[corner][i]],
                  {weighted_sdf_[d][corner][i], weights_[d][corner][i], nearest_[d][corner][i], 0});
      }
    }
  }

  /// Which voxels the corners are. One outside the block is made any of its voxels, without a
  /// weight: no branches, which nobody could foresee.
  void placeIn(const BlockFrame& frame) {
    const BlockFrame block = frame;  // a copy of its own, which no result can overlap
    for (int i = 0; i < kPlanes; ++i) {
      const PlaneInBlock at = planeInBlock(block, plane_[i], samples_.u[i], samples_.v[i]);
      for (int corner = 0; corner < 4; ++corner) {
        const int32_t held = -static_cast<int32_t>(at.holds(corner));
        index_[corner][i] = (at.index + cornerOffset(block.strides, corner)) & held;
        for (int d = 0; d < 3; ++d) {
          const VoxelSums sample = sumsOfSample(weights_[d][corner][i] & held, sdf_[corner][i],
                                                samples_.point_key[corner][i]);
          weighted_sdf_[d][corner][i] = sample.weighted_sdf;
          weights_[d][corner][i] = static_cast<int32_t>(sample.weight);
          nearest_[d][corner][i] = sample.nearest;
        }
      }
    }
  }

  /// Also of places that none was entered at, which hold older ones: a loop of fixed length.
  void compute(int axis, float sdf_scale) {
    const Vec3i shifts = pointShifts(axis);
    for (int i = 0; i < kPlanes; ++i) {
      const SampleLine line{0,
                            0.0f,
                            per_reach_[i],
                            0,
                            0,
                            p_k_[i],
                            p_u_[i],
                            p_v_[i],
                            slope_u_[i],
                            slope_v_[i],
                            normal_k_[i],
                            normal_u_[i],
                            normal_v_[i],
                            kHasSides ? sidesAt(i) : noSides()};
      samplePlane<kHasSides>(line, shifts, plane_[i], i, samples_);
      for (int corner = 0; corner < 4; ++corner) {
        sdf_[corner][i] = roundSdf(samples_.distance[corner][i] * sdf_scale);
        for (int d = 0; d < 3; ++d) {
          weights_[d][corner][i] = roundWeight(samples_.share[corner][i] * weight_[d][i]);
        }
      }
    }
  }

  static constexpr int kSideValues = 8;

  int count_ = 0;
  const KeptLine* line_[kPlanes] = {};
  int32_t plane_[2 * kPlanes] = {};
  PerPlane per_reach_ = {}, p_k_ = {}, p_u_ = {}, p_v_ = {}, slope_u_ = {}, slope_v_ = {};
  PerPlane normal_k_ = {}, normal_u_ = {}, normal_v_ = {};
  PerPlane weight_[3] = {};
  PerPlane sides_[kHasSides ? kSideValues : 1] = {};
  PlaneSamples<kPlanes> samples_;
  int32_t index_[4][kPlanes];
  int32_t sdf_[4][kPlanes], weights_[3][4][kPlanes];  ///< In fixed point.
  int64_t weighted_sdf_[3][4][kPlanes];
  uint32_t nearest_[3][4][kPlanes];
};

/// A block's sums, and the planes that wait to be added to them.
class BlockCasting {
 public:
  BlockCasting(const TouchedBlock& block, const FusionSettings& fusion, BlockSums& sums)
      : frames_{blockFrameOf(0, block.block_L), blockFrameOf(1, block.block_L),
                blockFrameOf(2, block.block_L)},
        sdf_scale_(sdfScale(fusion)),
        sums_(sums) {}

  void add(const KeptLine& line, const MeasuredSides& sides) {
    if (line.has_sides) {
      auto& batch = of_subpixels_[line.axis];
      if (!batch) batch.emplace();
      enter(line, sides, *batch);
    } else {
      enter(line, sides, of_points_[line.axis]);
    }
  }

  void finish() {
    for (int axis = 0; axis < 3; ++axis) {
      flush(of_points_[axis], axis);
      if (of_subpixels_[axis]) flush(*of_subpixels_[axis], axis);
    }
  }

 private:
  template <class Batch>
  void enter(const KeptLine& line, const MeasuredSides& sides, Batch& batch) {
    const int axis = line.axis;
    Span planes = planesInside(line.planes, frames_[axis]);
    while (planes.first <= planes.last) {
      planes.first += batch.enter(line, sides, planes);
      if (batch.isFull()) flush(batch, axis);
    }
  }

  template <class Batch>
  void flush(Batch& batch, int axis) {
    batch.addTo(frames_[axis], axis, sdf_scale_, sums_);
  }

  const BlockFrame frames_[3];
  const float sdf_scale_;
  BlockSums& sums_;
  PlaneBatch<false> of_points_[3];
  std::optional<PlaneBatch<true>> of_subpixels_[3];  // few blocks have any
};

}  // namespace

void clearSums(BlockSums& sums, uint32_t directions) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directions >> d & 1) std::memset(sums.voxel[d], 0, sizeof(sums.voxel[d]));
  }
}

void cast(const TouchedBlock& block, const BlockFinder& finder, const FusionSettings& fusion,
          BlockSums& sums) {
  constexpr int kAhead = 6;  // lines lie apart in memory
  withWidestVectors([&] {
    BlockCasting casting(block, fusion, sums);
    for (const SurfelRange& range : block.surfels) {
      for (const uint32_t* i = range.begin; i != range.end; ++i) {
        if (range.end - i > kAhead) __builtin_prefetch(&finder.line(i[kAhead]));
        casting.add(finder.line(*i), finder.sides(*i));
      }
    }
    casting.finish();
  });
}

void findCovered(BlockSums& sums, int direction) {
  VoxelSet& covered = sums.covered[direction];
  const VoxelSums* voxel = sums.voxel[direction];
  for (uint64_t& word : covered.word) {
    word = 0;
    for (int i = 0; i < VoxelSet::kWordBits; ++i, ++voxel) {
      word |= static_cast<uint64_t>(voxel->weight != 0) << i;
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
