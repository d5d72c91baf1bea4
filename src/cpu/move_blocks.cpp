// What paging asks of the backend on the CPU.
#include <cstring>

#include "cpu/cpu_backend.h"
#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

constexpr size_t kLabel = sizeof(UnitLabels);

}  // namespace

std::vector<PackedKey> CpuBackend::touchedKeys() {
  std::vector<PackedKey> keys;
  keys.reserve(block_finder_.touched().size());
  for (const TouchedBlock& block : block_finder_.touched()) keys.push_back(block.key);
  return keys;
}

std::vector<PackedKey> CpuBackend::seenThrough(const std::vector<PackedKey>& keys,
                                               uint64_t frame_number) {
  std::vector<PackedKey> seen;
  for (const PackedKey key : keys) {
    if (isInTurnToBeSeenThrough(unpackKey(key), frame_number)) seen.push_back(key);
  }
  return seen;
}

LeavingBlocks CpuBackend::takeOut(const std::vector<int32_t>& slots) {
  std::vector<size_t> begins;
  size_t bytes = 0;
  for (const int32_t slot : slots) {
    begins.push_back(bytes);
    bytes += table_.bytesOf(slot) - BlockTable::kBlockBytes + mesher_.labels(slot).size() * kLabel;
  }
  LeavingBlocks leaving{{}, makePlainRecords(bytes)};
  leaving.states.reserve(slots.size());
  inBatches(slots.size(), threads_, [&](size_t i) {
    char* to = leaving.records->data() + begins[i];
    const auto append = [&](const void* from, size_t size) {
      std::memcpy(to, from, size);
      to += size;
    };
    const BlockEntry& entry = table_.block(slots[i]);
    for (const int32_t array : entry.array) {
      if (array != kNoArray) append(voxels_.array(array), BlockTable::kArrayBytes);
    }
    visitBricks(table_, entry, [&](int, int, int32_t number) {
      append(colours_.array(number), BlockTable::kColourBytes);
    });
    const std::vector<UnitLabels>& labels = mesher_.labels(slots[i]);
    if (!labels.empty()) append(labels.data(), labels.size() * kLabel);
  });
  for (const int32_t slot : slots) leaving.states.push_back(mesher_.takeState(slot));
  return leaving;
}

void CpuBackend::putIn(const std::vector<int32_t>& slots,
                       const std::vector<ArrivingBlock>& blocks) {
  std::vector<const UnitLabels*> labels(slots.size(), nullptr);
  inBatches(slots.size(), threads_, [&](size_t i) {
    if (blocks[i].record.records == nullptr) return;
    const char* from = blocks[i].record.data();
    const auto take = [&](void* to, size_t size) {
      std::memcpy(to, from, size);
      from += size;
    };
    const BlockEntry& entry = table_.block(slots[i]);
    for (const int32_t array : entry.array) {
      if (array != kNoArray) take(voxels_.array(array), BlockTable::kArrayBytes);
    }
    visitBricks(table_, entry, [&](int, int, int32_t number) {
      take(colours_.array(number), BlockTable::kColourBytes);
    });
    if (blocks[i].state.has_labels) labels[i] = reinterpret_cast<const UnitLabels*>(from);
  });
  for (size_t i = 0; i < slots.size(); ++i) {
    mesher_.enterState(slots[i], blocks[i].state, labels[i]);
  }
}

std::vector<MeshMarks> CpuBackend::takeMarks(const std::vector<int32_t>& slots) {
  std::vector<MeshMarks> marks;
  marks.reserve(slots.size());
  for (const int32_t slot : slots) marks.push_back(mesher_.takeMarks(slot));
  return marks;
}

void CpuBackend::setMarks(const std::vector<int32_t>& slots, const std::vector<MeshMarks>& marks) {
  for (size_t i = 0; i < slots.size(); ++i) mesher_.setMarks(slots[i], marks[i]);
}

}  // namespace dtsdf
