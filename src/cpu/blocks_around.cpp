#include "cpu/blocks_around.h"

namespace dtsdf {

SlotsAround slotsAround(const BlockTable& table, const BlockKey& key) {
  SlotsAround slots;
  for (int n = 0; n < kBlocksAround; ++n) slots[n] = table.find(packKey(key + aroundOffset(n)));
  return slots;
}

ArraysAround arraysAround(const CpuMap& map, const SlotsAround& slots, int32_t least_evidence) {
  ArraysAround around;
  around.least_evidence = least_evidence;
  for (int n = 0; n < kBlocksAround; ++n) {
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = slots[n] < 0 ? kNoArray : map.table.block(slots[n]).array[d];
      around.array[n][d] = array == kNoArray ? nullptr : map.voxels.array(array);
    }
  }
  return around;
}

EdgeVoxels::EdgeVoxels(const ArraysAround& arrays, int edge, bool directional, uint32_t directions)
    : edge_(edge),
      directional_(directional),
      samples_(arrays, cornerAt(edgeCorner(edge)), edgeAxis(edge), directional) {
  const Vec3i lower = cornerAt(edgeCorner(edge)), upper = lower + unitStep(edgeAxis(edge));
  const Voxel* const* const lower_arrays = arrays.array[blockAround(lower)];
  const Voxel* const* const upper_arrays = arrays.array[blockAround(upper)];
  const auto read = [&](int d, int array) {
    constexpr Voxel kNothing = {0, kNoAnchor, 0};
    const Voxel* at_lower = lower_arrays[array];
    const Voxel* at_upper = upper_arrays[array];
    const Voxel& a = at_lower == nullptr ? kNothing : at_lower[indexInBlock(lower)];
    const Voxel& b = at_upper == nullptr ? kNothing : at_upper[indexInBlock(upper)];
    samples_.lower[d] = sampleOf(a, arrays.least_evidence);
    samples_.upper[d] = sampleOf(b, arrays.least_evidence);
    anchor_[0][d] = a.anchor;
    anchor_[1][d] = b.anchor;
  };
  if (directional) {
    visitDirections(directions, [&](int d) { read(d, d); });
  } else {
    read(facedDirection(edgeAxis(edge), edgeFacing(edge)), 0);
  }
}

}  // namespace dtsdf
