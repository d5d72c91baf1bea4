#include "move_blocks.h"

#include <algorithm>

#include "kernels/fusion/free_space.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Blocks that a thread of the host looks at at a time, and how many threads do.
constexpr size_t kSlotsAtOnce = 256;
constexpr int kHostThreads = 4;

}  // namespace

/// By the frustum alone: some of them show nothing of what is free.
std::vector<PackedKey> CudaBlockMover::seenThrough(const std::vector<PackedKey>& keys,
                                                   uint64_t frame_number) {
  std::vector<PackedKey> seen;
  if (!parts_.sensing->hasFreeDepth()) return seen;
  const FrameView& frame = parts_.sensing->frame();
  const BlockKey origin = blockOfVoxel(frame.origin_voxel);
  for (const PackedKey key : keys) {
    const bool is_in_turn = isInTurn(key, frame_number, fusion_rules_);
    if (is_in_turn && mayBeInView(frame, unpackKey(key) - origin)) seen.push_back(key);
  }
  return seen;
}

std::vector<MeshState> CudaBlockMover::takeMeshStates(const std::vector<int32_t>& slots) {
  std::vector<UnitLabels> labels(slots.size() * kVoxelsPerBlock);
  parts_.records.download(parts_.map.labels(), slots, labels.data());
  std::vector<MeshState> states(slots.size());
  forEachInParallel(
      (slots.size() + kSlotsAtOnce - 1) / kSlotsAtOnce, kHostThreads, [&](size_t part) {
        for (size_t i = part * kSlotsAtOnce; i < std::min(slots.size(), (part + 1) * kSlotsAtOnce);
             ++i) {
          const auto first = labels.begin() + static_cast<std::ptrdiff_t>(i * kVoxelsPerBlock);
          if (std::all_of(first, first + kVoxelsPerBlock, saysNothing)) continue;
          states[i].labels.assign(first, first + kVoxelsPerBlock);
        }
      });
  const std::vector<MeshMarks> marks = takeMarks(slots);  // once nothing can lack memory any more
  for (size_t i = 0; i < slots.size(); ++i) {
    states[i].marks = marks[i];
    states[i].has_mesh = parts_.mesher.takeHasMesh(slots[i]);
  }
  return states;
}

void CudaBlockMover::enterMeshStates(const std::vector<int32_t>& slots,
                                     const std::vector<MeshState>& states) {
  std::vector<UnitLabels> labels(slots.size() * kVoxelsPerBlock, UnitLabels{});
  std::vector<MeshMarks> marks;
  for (size_t i = 0; i < slots.size(); ++i) {
    std::copy(states[i].labels.begin(), states[i].labels.end(),
              labels.begin() + static_cast<std::ptrdiff_t>(i * kVoxelsPerBlock));
    parts_.mesher.setHasMesh(slots[i], states[i].has_mesh);
    marks.push_back(states[i].marks);
  }
  parts_.records.upload(parts_.map.labels(), slots, labels.data());
  takeMarks(slots);  // of those that had the slots before
  setMarks(slots, marks);
}

void CudaBlockMover::setMarks(const std::vector<int32_t>& slots,
                              const std::vector<MeshMarks>& marks) {
  marks_.set(parts_.map.view(), slots, marks);
  parts_.bounds.dirty += slots.size();
  parts_.bounds.painted += slots.size();
}

}  // namespace gpu
}  // namespace dtsdf
