/// A row of voxels, along x, taken apart into vectors.
#pragma once

#include <cstring>

#include "cpu/lanes.h"
#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"

namespace dtsdf {

static_assert(kLanes == kBlockSide, "a row fills the lanes");

struct VoxelRow {
  LaneInts sdf_units, anchor, state;

  /// Of voxels that lie anywhere: their first words, and their states.
  VoxelRow(const LaneInts& words, const LaneInts& states) : state(states) { takeApart(words.v); }

  explicit VoxelRow(const Voxel* voxels) {
    int32_t lo[8], st[8];
    for (int i = 0; i < 8; ++i) {
      lo[i] = (int32_t)((uint32_t)(uint16_t)voxels[i].sdf_units | (uint32_t)voxels[i].anchor << 16);
      st[i] = (int32_t)voxels[i].state;
    }
    LaneInts::Vector low;
    std::memcpy(&low, lo, 32);
    std::memcpy(&state.v, st, 32);
    takeApart(low);
  }

  LaneFloats sdf() const { return toFloats(sdf_units) * LaneFloats(1.0f / kStoredSdfScale); }
  LaneInts weightUnits() const { return LaneInts(state.v >> 8 & 0xffffff); }
  LaneFloats weight() const {
    return toFloats(weightUnits()) * LaneFloats(1.0f / kStoredWeightScale);
  }
  LaneInts evidence() const { return LaneInts(state.v << 24 >> 24); }

  /// As sampleOf() of each.
  SampleOf<LaneFloats> samples(int32_t least_evidence) const {
    const LaneInts known = evidence() > LaneInts(least_evidence - 1);
    return {sdf(), select(known, weight(), LaneFloats(0.0f))};
  }

 private:
  void takeApart(const LaneInts::Vector& words) {
    constexpr bool kLittle = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
    sdf_units.v = (kLittle ? words << 16 : words) >> 16;
    anchor.v = (kLittle ? words >> 16 : words) & 0xffff;
  }
};

}  // namespace dtsdf
