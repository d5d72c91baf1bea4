#include "move_blocks.h"

#include <algorithm>
#include <utility>

#include "backend/map_copy.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {
namespace gpu {

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

void CudaBlockMover::reserve(const MapSize& size) {
  parts_.carrier.reserve(size.voxel_arrays + size.bricks + size.blocks);
  marks_.reserve(size.blocks);
}

/// Of a block whose record lies at an address, or so many bytes behind one. @return where the next
/// one does.
uintptr_t CudaBlockMover::addPieces(int32_t slot, uintptr_t at, RecordPieces& pieces) const {
  const auto add = [&](std::vector<RecordPiece>& list, int32_t record, size_t bytes) {
    list.push_back({reinterpret_cast<uint4*>(at), record});
    at += bytes;
  };
  const BlockEntry& entry = parts_.table.block(slot);
  for (const int32_t array : entry.array) {
    if (array != kNoArray) add(pieces.arrays, array, VoxelPool::kRecordBytes);
  }
  visitBricks(parts_.table, entry, [&](int, int, int32_t number) {
    add(pieces.bricks, number, ColourPool::kRecordBytes);
  });
  add(pieces.labels, slot, LabelPool::kRecordBytes);
  return at;
}

/// Whether labels say anything only the device knows: they always come along.
LeavingBlocks CudaBlockMover::takeOut(const std::vector<int32_t>& slots) {
  marks_.reserve(slots.size());
  RecordPieces pieces;
  pieces.arrays.reserve(slots.size());
  pieces.labels.reserve(slots.size());
  uintptr_t bytes = 0;
  for (const int32_t slot : slots) bytes = addPieces(slot, bytes, pieces);
  LeavingBlocks leaving;
  leaving.states.resize(slots.size());
  parts_.carrier.reserve(pieces.count());  // for putIn(), too, if they have to stay
  leaving.records = parts_.carrier.takeOut(std::move(pieces), bytes, parts_.map);
  const std::vector<MeshMarks> marks = takeMarks(slots);  // once nothing can lack memory any more
  for (size_t i = 0; i < slots.size(); ++i) {
    leaving.states[i] = {marks[i], parts_.mesher.takeHasMesh(slots[i]), true};
  }
  return leaving;
}

void CudaBlockMover::putIn(const std::vector<int32_t>& slots,
                           const std::vector<ArrivingBlock>& blocks) {
  RecordPieces pieces;
  std::vector<PinnedRecords*> records;
  std::vector<MeshMarks> marks;
  for (size_t i = 0; i < slots.size(); ++i) {
    const ArrivingBlock& block = blocks[i];
    marks.push_back(block.state.marks);
    parts_.mesher.setHasMesh(slots[i], block.state.has_mesh);
    if (block.record.records == nullptr) {
      pieces.labels.push_back({nullptr, slots[i]});
      continue;
    }
    auto* const from = static_cast<PinnedRecords*>(block.record.records.get());
    if (std::find(records.rbegin(), records.rend(), from) == records.rend()) {
      records.push_back(from);
    }
    addPieces(slots[i], reinterpret_cast<uintptr_t>(block.record.data()), pieces);
  }
  parts_.carrier.putIn(pieces, records, parts_.map);
  takeMarks(slots);  // of those that had the slots before
  setMarks(slots, marks);
}

/// The host knows where nothing is marked.
std::vector<MeshMarks> CudaBlockMover::takeMarks(const std::vector<int32_t>& slots) {
  return hasMarks() ? marks_.take(parts_.map.view(), slots) : std::vector<MeshMarks>(slots.size());
}

void CudaBlockMover::setMarks(const std::vector<int32_t>& slots,
                              const std::vector<MeshMarks>& marks) {
  const auto is_marked = [](const MeshMarks& one) { return one.dirty || one.painted; };
  if (std::none_of(marks.begin(), marks.end(), is_marked)) return;
  marks_.set(parts_.map.view(), slots, marks);
  parts_.bounds.dirty += slots.size();
  parts_.bounds.painted += slots.size();
}

}  // namespace gpu
}  // namespace dtsdf
