// What paging asks of the backend on the CPU.
#include "cpu/cpu_backend.h"

namespace dtsdf {

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

std::vector<MeshState> CpuBackend::takeMeshStates(const std::vector<int32_t>& slots) {
  std::vector<MeshState> states;
  states.reserve(slots.size());
  for (const int32_t slot : slots) states.push_back(mesher_.takeState(slot));
  return states;
}

void CpuBackend::enterMeshStates(const std::vector<int32_t>& slots,
                                 const std::vector<MeshState>& states) {
  for (size_t i = 0; i < slots.size(); ++i) mesher_.enterState(slots[i], states[i]);
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
