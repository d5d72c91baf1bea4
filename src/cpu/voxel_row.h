/// A row of voxels along x, split into one vector per field.
#pragma once

#include <cstring>

#include "cpu/lanes.h"
#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"

namespace dtsdf {

static_assert(kLanes == kBlockSide, "a row must fill the lanes");

struct VoxelRow {
  LaneInts sdf_units, anchor, state;

  explicit VoxelRow(const Voxel* voxels) {
    LaneInts::Vector first, last;  // even words: distance and anchor; odd words: state
    static_assert(sizeof(first) + sizeof(last) == kBlockSide * sizeof(Voxel), "");
    std::memcpy(&first, voxels, sizeof(first));
    std::memcpy(&last, voxels + kLanes / 2, sizeof(last));
#ifdef __clang__
    const LaneInts::Vector low = __builtin_shufflevector(first, last, 0, 2, 4, 6, 8, 10, 12, 14);
    state.v = __builtin_shufflevector(first, last, 1, 3, 5, 7, 9, 11, 13, 15);
#else  // GCC before 12 has no __builtin_shufflevector
    constexpr LaneInts::Vector kEven = {0, 2, 4, 6, 8, 10, 12, 14};
    constexpr LaneInts::Vector kOdd = {1, 3, 5, 7, 9, 11, 13, 15};
    const LaneInts::Vector low = __builtin_shuffle(first, last, kEven);
    state.v = __builtin_shuffle(first, last, kOdd);
#endif
    constexpr bool kLittle = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
    sdf_units.v = (kLittle ? low << 16 : low) >> 16;
    anchor.v = (kLittle ? low >> 16 : low) & 0xffff;
  }

  LaneFloats sdf() const { return toFloats(sdf_units) * LaneFloats(1.0f / kStoredSdfScale); }
  LaneInts weightUnits() const { return LaneInts(state.v >> 8 & 0xffffff); }
  LaneInts evidence() const { return LaneInts(state.v << 24 >> 24); }

  /// Weights as returned by sampleOf().
  LaneFloats knownWeight(int32_t min_evidence) const {
    const LaneInts known = evidence() > LaneInts(min_evidence - 1);
    const LaneFloats weight = toFloats(weightUnits()) * LaneFloats(1.0f / kStoredWeightScale);
    return select(known, weight, LaneFloats(0.0f));
  }
};

}  // namespace dtsdf
