/// The blocks that a frame looks at without touching them. For .cu files.
#pragma once

#include "find_blocks.cuh"
#include "kernels/fusion/free_space.h"

namespace dtsdf {
namespace gpu {

/// The blocks that a frame looks at besides those that it touches, and those among which they are;
/// FrameCounters counts them.
struct LookList {
  const int32_t* in_view;
  uint32_t in_view_count;
  int32_t* slots;
};

/// Lists a block that the frame looks at untouched. One that was released since the host listed it
/// has no arrays, so that nothing comes of a look at it.
__device__ __forceinline__ void findLook(const FrameView& frame, const FusionRules& rules,
                                         const FusionTarget& target, uint64_t frame_number,
                                         const LookList& looks, uint32_t i) {
  if (i >= looks.in_view_count) return;
  const int32_t slot = looks.in_view[i];
  const PackedKey key = target.map.slots[slot].key;
  if (key == kNoKey || !isInTurn(key, frame_number, rules)) return;
  if (!mayBeInView(frame, unpackKey(key) - blockOfVoxel(frame.origin_voxel))) return;
  if (findTouched(target.touched, key) >= 0) return;
  looks.slots[atomicAdd(&target.touched.counters->looks, 1u)] = slot;
}

}  // namespace gpu
}  // namespace dtsdf
