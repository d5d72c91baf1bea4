#include "cpu/cast.h"

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

  void enter(const CastLine& cast, int plane) {
    const SampleLine& line = cast.line;
    const int i = count_++;
    directions_[i] = &cast.directions;
    plane_[i] = plane;
    per_reach_[i] = line.per_reach;
    p_k_[i] = line.p_k;
    p_u_[i] = line.p_u;
    p_v_[i] = line.p_v;
    slope_u_[i] = line.slope_u;
    slope_v_[i] = line.slope_v;
    normal_k_[i] = line.normal_k;
    normal_u_[i] = line.normal_u;
    normal_v_[i] = line.normal_v;
    if (kHasSides) sides_[i] = line.sides;
    for (int d = 0; d < 3; ++d) weight_[d][i] = cast.directions.weight[d];
  }

  /// Adds the planes that were entered to the sums of a block, and forgets them.
  void addTo(const BlockFrame& block, int axis, float sdf_scale, BlockSums& sums) {
    if (count_ == 0) return;
    withWidestVectors([&] { compute(axis, sdf_scale); });
    for (int i = 0; i < count_; ++i) addPlane(block, i, sums);
    count_ = 0;
  }

 private:
  void addPlane(const BlockFrame& block, int i, BlockSums& sums) const {
    const DirectionSet& directions = *directions_[i];
    const PlaneInBlock at = planeInBlock(block, plane_[i], samples_.u[i], samples_.v[i]);
    const bool holds_all = at.holds(0) && at.holds(3);
    for (int corner = 0; corner < 4; ++corner) {
      if (!holds_all && !at.holds(corner)) continue;
      const int index = at.index + cornerOffset(block.strides, corner);
      for (int d = 0; d < directions.count; ++d) {
        addToSums(sums.voxel[directions.direction[d]][index], weights_[d][corner][i],
                  sdf_[corner][i], samples_.point_key[corner][i]);
      }
    }
  }

  /// Also of places that none was entered at, which hold older ones: a loop of fixed length.
  void compute(int axis, float sdf_scale) {
    const Vec3i shifts = pointShifts(axis);
    for (int i = 0; i < kPlanes; ++i) {
      const SampleLine line{0,           0.0f,        per_reach_[i], 0,
                            0,           p_k_[i],     p_u_[i],       p_v_[i],
                            slope_u_[i], slope_v_[i], normal_k_[i],  normal_u_[i],
                            normal_v_[i],
                            kHasSides ? sides_[i] : noSides()};
      samplePlane<kHasSides>(line, shifts, plane_[i], i, samples_);
      for (int corner = 0; corner < 4; ++corner) {
        sdf_[corner][i] = roundSdf(samples_.distance[corner][i] * sdf_scale);
        for (int d = 0; d < 3; ++d) {
          weights_[d][corner][i] = roundWeight(samples_.share[corner][i] * weight_[d][i]);
        }
      }
    }
  }

  int count_ = 0;
  const DirectionSet* directions_[kPlanes] = {};
  int32_t plane_[kPlanes] = {};
  float per_reach_[kPlanes] = {}, p_k_[kPlanes] = {}, p_u_[kPlanes] = {}, p_v_[kPlanes] = {};
  float slope_u_[kPlanes] = {}, slope_v_[kPlanes] = {};
  float normal_k_[kPlanes] = {}, normal_u_[kPlanes] = {}, normal_v_[kPlanes] = {};
  MeasuredSides sides_[kPlanes] = {};
  float weight_[3][kPlanes] = {};
  PlaneSamples<kPlanes> samples_;
  int32_t sdf_[4][kPlanes], weights_[3][4][kPlanes];  ///< In fixed point.
};

/// A block's sums, and the planes that wait to be added to them.
class BlockCasting {
 public:
  BlockCasting(const TouchedBlock& block, const FusionSettings& fusion, BlockSums& sums)
      : frames_{blockFrameOf(0, block.block_L), blockFrameOf(1, block.block_L),
                blockFrameOf(2, block.block_L)},
        sdf_scale_(sdfScale(fusion)),
        sums_(sums) {}

  void add(const CastLine& cast) {
    if (cast.line.sides.areMeasured()) {
      auto& batch = of_subpixels_[cast.line.axis];
      if (!batch) batch.emplace();
      enter(cast, *batch);
    } else {
      enter(cast, of_points_[cast.line.axis]);
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
  void enter(const CastLine& cast, Batch& batch) {
    const int axis = cast.line.axis;
    const Span planes = planesInside(cast.line, frames_[axis]);
    for (int plane = planes.first; plane <= planes.last; ++plane) {
      batch.enter(cast, plane);
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
  BlockCasting casting(block, fusion, sums);
  for (const SurfelRange& range : block.surfels) {
    for (const uint32_t* i = range.begin; i != range.end; ++i) {
      if (range.end - i > kAhead) __builtin_prefetch(&finder.line(i[kAhead]));
      casting.add(finder.line(*i));
    }
  }
  casting.finish();
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
