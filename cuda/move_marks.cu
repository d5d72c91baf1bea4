// Reads and sets marks for the next mesh extraction when blocks are moved to disk or back.
#include <algorithm>

#include "device_map.cuh"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

__device__ MeshMarks marksOf(const MapView& map, int32_t slot) {
  return {map.dirty.flags[slot] != 0, map.painted.flags != nullptr && map.painted.flags[slot] != 0};
}

/// One thread per slot.
__global__ void readMarksKernel(MapView map, MeshMarks* marks) {
  const size_t i = globalThread();
  if (i >= map.slot_count) return;
  const auto slot = static_cast<int32_t>(i);
  marks[i] = map.slots[slot].key == kNoKey ? MeshMarks{} : marksOf(map, slot);
}

/// One thread per requested slot. Also empties the lists of marked slots; listMarkedKernel() fills
/// them again.
__global__ void takeMarksKernel(MapView map, const int32_t* slots, size_t count, MeshMarks* marks) {
  const size_t i = globalThread();
  if (i == 0) {
    *map.dirty.count = 0;
    if (map.painted.count != nullptr) *map.painted.count = 0;
  }
  if (i >= count) return;
  marks[i] = marksOf(map, slots[i]);
  map.dirty.flags[slots[i]] = 0;
  if (map.painted.flags != nullptr) map.painted.flags[slots[i]] = 0;
}

/// One thread per slot. Lists the slots that are still marked.
__global__ void listMarkedKernel(MapView map) {
  const size_t i = globalThread();
  if (i >= map.slot_count) return;
  const auto slot = static_cast<int32_t>(i);
  const MeshMarks marks = marksOf(map, slot);
  if (marks.dirty) map.dirty.slots[atomicAdd(map.dirty.count, 1u)] = slot;
  if (marks.painted) map.painted.slots[atomicAdd(map.painted.count, 1u)] = slot;
}

/// One thread per slot in `slots`.
__global__ void setMarksKernel(MapView map, const int32_t* slots, size_t count,
                               const MeshMarks* marks) {
  const size_t i = globalThread();
  if (i >= count) return;
  if (marks[i].dirty) mark(map.dirty, slots[i]);
  if (marks[i].painted && map.painted.flags != nullptr) mark(map.painted, slots[i]);
}

}  // namespace

void DeviceMap::reserveMarks(size_t slots) {
  marks_moved_.wait();
  marked_slots_.reserve(slots);
  marks_.reserve(slots);
}

std::vector<MarkedSlot> DeviceMap::marked() {
  if (slot_count_ == 0) return {};
  reserveMarks(slot_count_);
  launch("readMarksKernel", readMarksKernel, blocksFor(slot_count_), kThreads, 0, stream_, view(),
         marks_.data());
  stream_.synchronize();
  std::vector<MarkedSlot> marked;
  for (size_t slot = 0; slot < slot_count_; ++slot) {
    const MeshMarks& marks = marks_[slot];
    if (marks.any()) marked.push_back({static_cast<int32_t>(slot), marks});
  }
  return marked;
}

std::vector<MeshMarks> DeviceMap::takeMarks(const std::vector<int32_t>& slots) {
  if (slots.empty()) return {};
  reserveMarks(slots.size());
  std::copy(slots.begin(), slots.end(), marked_slots_.data());
  launch("takeMarksKernel", takeMarksKernel, blocksFor(slots.size()), kThreads, 0, stream_, view(),
         marked_slots_.data(), slots.size(), marks_.data());
  launch("listMarkedKernel", listMarkedKernel, blocksFor(slot_count_), kThreads, 0, stream_,
         view());
  stream_.synchronize();
  return {marks_.data(), marks_.data() + slots.size()};
}

void DeviceMap::setMarks(const std::vector<MarkedSlot>& marked) {
  const size_t count = marked.size();
  if (count == 0) return;
  reserveMarks(count);
  for (size_t i = 0; i < count; ++i) {
    marked_slots_[i] = marked[i].slot;
    marks_[i] = marked[i].marks;
  }
  launch("setMarksKernel", setMarksKernel, blocksFor(count), kThreads, 0, stream_, view(),
         marked_slots_.data(), count, marks_.data());
  stream_.record(marks_moved_);
}

}  // namespace gpu
}  // namespace dtsdf
