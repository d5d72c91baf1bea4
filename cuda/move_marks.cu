#include "move_marks.h"

#include <algorithm>

#include "device_map.cuh"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr uint32_t kDirty = 1, kPainted = 2;

MeshMarks marksFrom(uint32_t bits) { return {(bits & kDirty) != 0, (bits & kPainted) != 0}; }

__device__ uint32_t marksOf(const MapView& map, int32_t slot) {
  const bool is_painted = map.painted.flags != nullptr && map.painted.flags[slot] != 0;
  return (map.dirty.flags[slot] != 0 ? kDirty : 0u) | (is_painted ? kPainted : 0u);
}

/// One thread per slot.
__global__ void readMarksKernel(MapView map, uint32_t* marks) {
  const size_t i = globalThread();
  if (i >= map.slot_count) return;
  const auto slot = static_cast<int32_t>(i);
  marks[i] = map.slots[slot].key == kNoKey ? 0 : marksOf(map, slot);
}

/// One thread per slot that is asked for. The lists of marked ones are empty then.
__global__ void takeMarksKernel(MapView map, const int32_t* slots, size_t count, uint32_t* marks) {
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

/// One thread per slot: lists those that are still marked, each once.
__global__ void listMarkedKernel(MapView map) {
  const size_t i = globalThread();
  if (i >= map.slot_count) return;
  const auto slot = static_cast<int32_t>(i);
  const uint32_t marks = marksOf(map, slot);
  if (marks & kDirty) map.dirty.slots[atomicAdd(map.dirty.count, 1u)] = slot;
  if (marks & kPainted) map.painted.slots[atomicAdd(map.painted.count, 1u)] = slot;
}

/// One thread per slot that is asked for.
__global__ void setMarksKernel(MapView map, const int32_t* slots, size_t count,
                               const uint32_t* marks) {
  const size_t i = globalThread();
  if (i >= count) return;
  if (marks[i] & kDirty) mark(map.dirty, slots[i]);
  if ((marks[i] & kPainted) && map.painted.flags != nullptr) mark(map.painted, slots[i]);
}

}  // namespace

void MarkMover::reserve(size_t slots) {
  done_.wait();
  slots_.reserve(slots);
  marks_.reserve(slots);
}

std::vector<MarkedSlot> MarkMover::marked(const MapView& map) {
  if (map.slot_count == 0) return {};
  done_.wait();
  marks_.reserve(map.slot_count);
  launch("readMarksKernel", readMarksKernel, blocksFor(map.slot_count), kThreads, 0, stream_, map,
         marks_.data());
  stream_.record(done_);
  done_.wait();
  std::vector<MarkedSlot> marked;
  for (uint32_t slot = 0; slot < map.slot_count; ++slot) {
    if (marks_[slot] != 0) marked.push_back({static_cast<int32_t>(slot), marksFrom(marks_[slot])});
  }
  return marked;
}

std::vector<MeshMarks> MarkMover::take(const MapView& map, const std::vector<int32_t>& slots) {
  if (slots.empty()) return {};
  reserve(slots.size());
  std::copy(slots.begin(), slots.end(), slots_.data());
  launch("takeMarksKernel", takeMarksKernel, blocksFor(slots.size()), kThreads, 0, stream_, map,
         slots_.data(), slots.size(), marks_.data());
  launch("listMarkedKernel", listMarkedKernel, blocksFor(map.slot_count), kThreads, 0, stream_,
         map);
  stream_.record(done_);
  done_.wait();
  std::vector<MeshMarks> marks(slots.size());
  for (size_t i = 0; i < slots.size(); ++i) marks[i] = marksFrom(marks_[i]);
  return marks;
}

void MarkMover::set(const MapView& map, const std::vector<MarkedSlot>& marked) {
  const size_t count = marked.size();
  if (count == 0) return;
  reserve(count);
  for (size_t i = 0; i < count; ++i) {
    slots_[i] = marked[i].slot;
    marks_[i] = (marked[i].marks.dirty ? kDirty : 0u) | (marked[i].marks.painted ? kPainted : 0u);
  }
  launch("setMarksKernel", setMarksKernel, blocksFor(count), kThreads, 0, stream_, map,
         slots_.data(), count, marks_.data());
  stream_.record(done_);
}

}  // namespace gpu
}  // namespace dtsdf
