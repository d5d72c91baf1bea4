#include <algorithm>

#include "device_map.cuh"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Initial capacities. They are large because reallocating takes longer than adding blocks.
constexpr size_t kFirstHash = 1 << 17, kFirstSlots = 1 << 15;
constexpr size_t kFirstUpdates = 1 << 13, kFirstNewArrays = 1 << 14;

/// Zeroes arrays and updates slots. The first thread blocks handle one array each, the remaining
/// ones one slot per thread. Both lists are in host memory.
__global__ void enterBlocksKernel(MapView map, const SlotUpdate* updates, uint32_t update_count,
                                  const int32_t* arrays, uint32_t array_count) {
  waitForPreviousKernel();
  const uint32_t block = blockIdx.x;
  if (block >= array_count) {
    const uint32_t i = (block - array_count) * blockDim.x + threadIdx.x;
    if (i >= update_count) return;
    const SlotUpdate update = updates[i];
    updateSlot(map, update);
    if (update.in_use && update.dirty) mark(map.dirty, update.slot);
    return;
  }
  const int32_t array = arrays[block];
  Voxel* voxels = map.voxels.record(array);
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) voxels[i] = Voxel{};
  if (threadIdx.x < kBricksPerArray && map.colour_of != nullptr) {  // drop old colours
    map.colour_of[static_cast<size_t>(array) * kBricksPerArray + threadIdx.x] = 0;
  }
}

__global__ void rehashSlotsKernel(MapView map) {
  const size_t slot = globalThread();
  if (slot >= map.slot_count || map.slots[slot].key == kNoKey) return;
  insertSlot(map, map.slots[slot].key, static_cast<int32_t>(slot));
}

/// One thread per slot.
__global__ void markAllKernel(MapView map, ChangedBlocks changed) {
  const size_t slot = globalThread();
  if (slot < map.slot_count && map.slots[slot].key != kNoKey) {
    mark(changed, static_cast<int32_t>(slot));
  }
}

/// One thread per voxel of the new bricks.
__global__ void clearColoursKernel(MapView map, const NewBrick* bricks, size_t count) {
  const size_t i = globalThread();
  if (i >= count * kVoxelsPerBrick) return;
  const NewBrick brick = bricks[i / kVoxelsPerBrick];
  map.colours.record(brick.colours)[i % kVoxelsPerBrick] = {0, 0, 0, 0};
  if (i % kVoxelsPerBrick != 0) return;
  map.colour_of[static_cast<size_t>(brick.array) * kBricksPerArray + brick.brick] =
      brick.colours + 1;
}

}  // namespace

const void* anyKernel() { return reinterpret_cast<const void*>(&enterBlocksKernel); }

SlotUpdate makeSlotUpdate(const BlockEntry& entry, int32_t slot, bool dirty) {
  SlotUpdate update;
  update.entry.key = packKey(entry.key);
  std::copy(entry.array, entry.array + kDirectionCount, update.entry.array);
  update.slot = slot;
  update.in_use = entry.in_use;
  update.dirty = dirty;
  return update;
}

DeviceMap::DeviceMap(const Stream& stream)
    : stream_(stream),
      updates_(kFirstUpdates),
      new_arrays_(kFirstNewArrays),
      changes_(kFirstUpdates) {
  reserveSlots(kFirstSlots);
  reserveHash(0, 0);
}

MapView DeviceMap::view() const {
  return {hash_keys_.data(),
          hash_slots_.data(),
          static_cast<uint32_t>(hash_size_ - 1),
          static_cast<uint32_t>(slot_count_),
          slots_.data(),
          voxels_.view(),
          unit_labels_.view(),
          colours_.view(),
          has_colours_ ? colour_of_.data() : nullptr,
          dirty_.view(),
          has_colours_ ? painted_.view() : ChangedBlocks{nullptr, nullptr, nullptr},
          mesh_stamp_.data()};
}

void DeviceMap::reserveSlots(size_t count) {
  slots_.growZeroed(count, stream_);
  dirty_.grow(count, stream_);
  mesh_stamp_.growZeroed(count, stream_);
}

void DeviceMap::reserve(const BlockTable& table, size_t new_blocks, size_t new_arrays) {
  const PoolSizes after = table.sizesAfter(new_blocks, new_arrays);
  reserveSlots(after.slots);
  unit_labels_.reserve(after.slots, stream_);
  voxels_.reserve(after.arrays, stream_);
  updates_sent_.wait();
  updates_.reserve(new_blocks);
  new_arrays_.reserve(new_arrays);
  if (has_colours_) growColours(after);
  reserveHash(new_blocks, table.blocksInUse());
}

void DeviceMap::noteDemand(const PoolSizes& asked) {
  const auto fading = [](size_t most, size_t now) { return std::max(most - most / 4, now); };
  recent_demand_ = {fading(recent_demand_.slots, asked.slots),
                    fading(recent_demand_.arrays, asked.arrays)};
}

/// Enlarges the pools that grow most often, by enough for several frames. If memory runs out, a
/// pool keeps its size.
void DeviceMap::reserveAhead(const BlockTable& table) {
  constexpr size_t kFrames = 8;
  const PoolSizes next = table.sizesAfter(recent_demand_.slots, recent_demand_.arrays);
  const PoolSizes most =
      table.sizesAfter(kFrames * recent_demand_.slots, kFrames * recent_demand_.arrays);
  try {
    unit_labels_.reserveAhead(next.slots, most.slots, stream_);
    voxels_.reserveAhead(next.arrays, most.arrays, stream_);
  } catch (const BackendError& error) {
    if (!error.isOutOfMemory()) throw;
  }
}

/// Grows the colour buffers that have an entry per voxel array or per slot.
void DeviceMap::growColours(const PoolSizes& sizes) {
  colour_of_.growZeroed(sizes.arrays * kBricksPerArray, stream_);
  painted_.grow(sizes.slots, stream_);
}

void DeviceMap::reserveColours(const BlockTable& table, size_t new_colours) {
  growColours({table.slotCount(), table.arrayCount()});
  colours_.reserve(table.colourCount() + new_colours, stream_);
  updates_sent_.wait();
  pinned_bricks_.reserve(new_colours);
  new_bricks_.reserve(new_colours, stream_);
}

void DeviceMap::enterColours(const std::vector<NewBrick>& bricks) {
  const size_t count = bricks.size();
  if (count == 0) return;
  updates_sent_.wait();
  pinned_bricks_.reserve(count);  // already reserved by reserveColours()
  new_bricks_.reserve(count, stream_);
  std::copy(bricks.begin(), bricks.end(), pinned_bricks_.data());
  new_bricks_.upload(pinned_bricks_.data(), count, stream_);
  stream_.record(updates_sent_);
  launch("clearColoursKernel", clearColoursKernel, blocksFor(count * kVoxelsPerBrick), kThreads, 0,
         stream_, view(), new_bricks_.data(), count);
}

void DeviceMap::keepColours() {
  has_colours_ = true;
  markAll(painted_.view());
}

/// Keys of released blocks stay in the hash table. When it is half full, it is rebuilt without
/// them.
void DeviceMap::reserveHash(size_t new_blocks, size_t live_blocks) {
  if (hash_size_ != 0 && 2 * (hash_used_ + new_blocks) <= hash_size_) return;
  size_t size = kFirstHash;
  while (size < 4 * (live_blocks + new_blocks)) size *= 2;
  // Both new tables are allocated before the old ones are freed, so that nothing changes if memory
  // runs out.
  DeviceBuffer<PackedKey> keys(size);
  DeviceBuffer<int32_t> slots(size);
  keys.fill(0xff, stream_);
  slots.fill(0xff, stream_);
  stream_.synchronize();
  hash_keys_ = std::move(keys);
  hash_slots_ = std::move(slots);
  hash_size_ = size;
  hash_used_ = live_blocks;
  if (slot_count_ == 0) return;
  launch("rehashSlotsKernel", rehashSlotsKernel, blocksFor(slot_count_), kThreads, 0, stream_,
         view());
}

void DeviceMap::reserveChanges(size_t count) {
  changes_sent_.wait();
  changes_.reserve(count);
}

void DeviceMap::enterBlocks(const BlockTable& table, const std::vector<int32_t>& slots,
                            const std::vector<int32_t>& arrays) {
  if (slots.empty()) return;
  sendChanges();
  updates_sent_.wait();
  hash_used_ += slots.size();
  slot_count_ = table.slotCount();
  for (size_t i = 0; i < slots.size(); ++i) {
    updates_[i] = makeSlotUpdate(table.block(slots[i]), slots[i]);
  }
  std::copy(arrays.begin(), arrays.end(), new_arrays_.data());
  const auto update_count = static_cast<uint32_t>(slots.size());
  const auto array_count = static_cast<uint32_t>(arrays.size());
  launchOverlapped("enterBlocksKernel", enterBlocksKernel, array_count + blocksFor(update_count),
                   kThreads, 0, stream_, view(), updates_.data(), update_count, new_arrays_.data(),
                   array_count);
  stream_.record(updates_sent_);
}

void DeviceMap::sendChanges() {
  if (noted_.empty()) return;
  reserveChanges(noted_.size());
  std::copy(noted_.begin(), noted_.end(), changes_.data());
  launchOverlapped("enterBlocksKernel", enterBlocksKernel, blocksFor(noted_.size()), kThreads, 0,
                   stream_, view(), changes_.data(), static_cast<uint32_t>(noted_.size()), nullptr,
                   0);
  stream_.record(changes_sent_);
  noted_.clear();
}

void DeviceMap::markAll(const ChangedBlocks& changed) {
  if (slot_count_ == 0) return;
  launch("markAllKernel", markAllKernel, blocksFor(slot_count_), kThreads, 0, stream_, view(),
         changed);
}

void DeviceMap::addMemory(const BlockTable& table, MapperMemory& memory) const {
  memory.spare += table.spareOf(voxels_.bytes() + colours_.bytes());
  memory.indices += unit_labels_.bytes() + slots_.bytes() + dirty_.bytes() + mesh_stamp_.bytes() +
                    hash_keys_.bytes() + hash_slots_.bytes() + colour_of_.bytes() +
                    painted_.bytes();
  addScratch(memory, new_bricks_, updates_, changes_, new_arrays_, pinned_bricks_, marked_slots_,
             marks_);
}

}  // namespace gpu
}  // namespace dtsdf
