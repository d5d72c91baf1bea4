// What paging asks of the backend on the CPU.
#include <cstring>

#include "cpu/cpu_backend.h"

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

/// Not on threads of its own, as images have these.
LeavingBlocks CpuBackend::takeOut(const std::vector<int32_t>& slots) {
  size_t bytes = 0;
  for (const int32_t slot : slots) {
    bytes += table_.bytesOf(slot) - BlockTable::kBlockBytes + mesher_.labels(slot).size() * kLabel;
  }
  LeavingBlocks leaving{{}, makePlainRecords(bytes)};
  leaving.states.reserve(slots.size());
  char* to = leaving.records->data();
  const auto append = [&](const void* from, size_t size) {
    std::memcpy(to, from, size);
    to += size;
  };
  for (const int32_t slot : slots) {
    const BlockEntry& entry = table_.block(slot);
    for (const int32_t array : entry.array) {
      if (array != kNoArray) append(voxels_.array(array), BlockTable::kArrayBytes);
    }
    visitBricks(table_, entry, [&](int, int, int32_t number) {
      append(colours_.array(number), BlockTable::kColourBytes);
    });
    const std::vector<UnitLabels>& labels = mesher_.labels(slot);
    if (!labels.empty()) append(labels.data(), labels.size() * kLabel);
  }
  for (const int32_t slot : slots) leaving.states.push_back(mesher_.takeState(slot));
  return leaving;
}

void CpuBackend::putIn(const std::vector<int32_t>& slots,
                       const std::vector<ArrivingBlock>& blocks) {
  for (size_t i = 0; i < slots.size(); ++i) {
    const ArrivingBlock& block = blocks[i];
    const UnitLabels* labels = nullptr;
    if (block.record.records != nullptr) {
      const char* from = block.record.data();
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
      if (block.state.has_labels) labels = reinterpret_cast<const UnitLabels*>(from);
    }
    mesher_.enterState(slots[i], block.state, labels);
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
