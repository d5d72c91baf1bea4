#include "map/block_table.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "map/sort_by_key.h"

namespace dtsdf {
namespace {

/// Takes a freed index or, if there is none, the next unused index.
int32_t takeNumber(std::vector<int32_t>& free, size_t& count) {
  if (free.empty()) return static_cast<int32_t>(count++);
  const int32_t number = free.back();
  free.pop_back();
  return number;
}

/// Squared distance from a point to the farthest corner of a cell, in voxels^2.
double squaredReach(const BlockCells::Cell& cell, const Vec3d& p) {
  constexpr double kHalf = 0.5 * BlockCells::kSide * kBlockSide;
  const auto outermost = [](int32_t key, double at) {
    return std::fabs((2.0 * key + 1.0) * kHalf - at) + kHalf;
  };
  const double x = outermost(cell.key.x, p.x), y = outermost(cell.key.y, p.y),
               z = outermost(cell.key.z, p.z);
  return x * x + y * y + z * z;
}

}  // namespace

/// Requested directions for which the block has no array.
uint32_t BlockTable::missingDirections(const BlockRequest& request, int32_t slot) const {
  const uint32_t there = slot < 0 ? 0 : directionsWithArrays(blocks_[static_cast<size_t>(slot)]);
  return request.directions & kAllDirections & ~there;
}

int32_t BlockTable::makeBlock(PackedKey key) {
  size_t count = blocks_.size();
  const int32_t slot = takeNumber(free_slots_, count);
  if (count > blocks_.size()) blocks_.push_back({});
  BlockEntry& entry = blocks_[static_cast<size_t>(slot)];
  entry = {unpackKey(key), {}, true, false, extractions_};
  std::fill_n(entry.array, kDirectionCount, kNoArray);
  unpublished_.push_back(slot);
  return slot;
}

void BlockTable::publish() {
  for (; !unpublished_.empty(); unpublished_.pop_back()) {
    const int32_t slot = unpublished_.back();
    const BlockKey& key = blocks_[static_cast<size_t>(slot)].key;
    cells_.insert(key, slot);
    slots_.insert(packKey(key), slot);
  }
}

/// Slots of the requested blocks; -1 for missing blocks. Prefetches in batches to hide memory
/// latency.
template <class Request>
std::vector<int32_t> BlockTable::findAll(const std::vector<Request>& requests) const {
  constexpr size_t kTogether = 32;
  std::vector<int32_t> slots(requests.size());
  for (size_t first = 0; first < slots.size(); first += kTogether) {
    const size_t end = std::min(first + kTogether, slots.size());
    for (size_t i = first; i < end; ++i) slots_.prefetch(requests[i].key);
    for (size_t i = first; i < end; ++i) {
      slots[i] = find(requests[i].key);
      if (slots[i] >= 0) __builtin_prefetch(&blocks_[static_cast<size_t>(slots[i])]);
    }
  }
  return slots;
}

Admission BlockTable::admit(std::vector<BlockRequest> requests) {
  Admission admission = allocate(std::move(requests));
  publish();
  return admission;
}

Admission BlockTable::allocate(std::vector<BlockRequest> requests) {
  unpublished_.reserve(requests.size());
  sortByKey(requests);
  const std::vector<int32_t> slots = findAll(requests);
  Admission admission;
  admission.changed_slots.reserve(requests.size());
  admission.new_arrays.reserve(2 * requests.size());
  for (size_t i = 0; i < requests.size(); ++i) {
    int32_t slot = slots[i];
    BlockRequest request = requests[i];
    while (i + 1 < requests.size() && requests[i + 1].key == request.key) {
      request.directions |= requests[++i].directions;
    }
    if (!extent_.blocks.contains(unpackKey(request.key))) continue;
    const uint32_t lacked = missingDirections(request, slot);
    const auto arrays = static_cast<size_t>(__builtin_popcount(lacked));
    const size_t bytes = (slot < 0 ? kBlockBytes : 0) + arrays * kArrayBytes;
    if (bytes == 0) continue;
    if (bytesInUse() + bytes > budget_bytes_) {
      ++admission.refused;
      continue;
    }
    if (slot < 0) slot = makeBlock(request.key);
    BlockEntry& entry = blocks_[static_cast<size_t>(slot)];
    for (uint32_t bits = lacked; bits != 0; bits &= bits - 1) {
      int32_t& array = entry.array[__builtin_ctz(bits)];
      array = takeNumber(free_arrays_, array_count_);
      admission.new_arrays.push_back(array);
    }
    arrays_in_use_ += arrays;
    admission.changed_slots.push_back(slot);
  }
  bytes_peak_ = std::max(bytes_peak_, bytesInUse());
  return admission;
}

/// Calls visit(array, brick) for the requested bricks that are not in the map yet.
template <class Visit>
void BlockTable::visitMissing(const std::vector<ColourRequest>& requests,
                              const Visit& visit) const {
  constexpr uint64_t kAllBricks = (uint64_t{1} << kDirectionCount * kBricksPerArray) - 1;
  const std::vector<int32_t> slots = findAll(requests);
  for (size_t n = 0; n < slots.size(); ++n) {
    if (slots[n] < 0 || !takesColour(blocks_[slots[n]].key)) continue;
    for (uint64_t bits = requests[n].bricks & kAllBricks; bits != 0; bits &= bits - 1) {
      const int i = __builtin_ctzll(bits), brick = i % kBricksPerArray;
      const int32_t array = blocks_[slots[n]].array[i / kBricksPerArray];
      if (array != kNoArray && colourOf(array, brick) == kNoArray) visit(array, brick);
    }
  }
}

size_t BlockTable::countNewColours(const std::vector<ColourRequest>& requests) const {
  size_t count = 0;
  visitMissing(requests, [&](int32_t, int) { ++count; });
  return std::min(count, budget_bytes_ / kColourBytes);
}

Admission BlockTable::admitColours(std::vector<ColourRequest> requests) {
  sortByKey(requests);
  Admission admission;
  visitMissing(requests, [&](int32_t array, int brick) {
    if (bytesInUse() + kColourBytes > budget_bytes_) {
      ++admission.refused;
    } else {
      admission.bricks.push_back({array, brick, makeColour(array, brick)});
    }
  });
  bytes_peak_ = std::max(bytes_peak_, bytesInUse());
  return admission;
}

int32_t BlockTable::makeColour(int32_t array, int brick) {
  const size_t place = static_cast<size_t>(array) * kBricksPerArray + brick;
  if (place >= colour_of_.size()) colour_of_.resize(array_count_ * kBricksPerArray, kNoArray);
  int32_t& colour = colour_of_[place];
  colour = takeNumber(free_colours_, colour_count_);
  ++colours_in_use_;
  return colour;
}

void BlockTable::releaseColours(int32_t array) {
  for (int brick = 0; brick < kBricksPerArray; ++brick) {
    const int32_t colour = colourOf(array, brick);
    if (colour == kNoArray) continue;
    free_colours_.push_back(colour);
    colour_of_[static_cast<size_t>(array) * kBricksPerArray + brick] = kNoArray;
    --colours_in_use_;
  }
}

PoolSizes BlockTable::sizesAfter(size_t new_blocks, size_t new_arrays) const {
  const auto within = [this](size_t wanted, size_t bytes_each, size_t at_least) {
    return std::max(std::min(wanted, budget_bytes_ / bytes_each), at_least);
  };
  return {within(blocksInUse() + new_blocks, kBlockBytes, slotCount()),
          within(arraysInUse() + new_arrays, kArrayBytes, arrayCount())};
}

PoolSizes BlockTable::countNew(const std::vector<BlockRequest>& requests) const {
  PoolSizes count{0, 0};
  for (const BlockRequest& request : requests) {
    if (!extent_.blocks.contains(unpackKey(request.key))) continue;
    const int32_t slot = find(request.key);
    count.slots += slot < 0;
    count.arrays += static_cast<size_t>(__builtin_popcount(missingDirections(request, slot)));
  }
  return count;
}

bool BlockTable::release(int32_t slot, uint32_t directions) {
  if (!releaseArrays(slot, directions)) return false;
  releaseBlock(slot);
  return true;
}

bool BlockTable::vacate(int32_t slot, uint32_t directions) {
  if (!releaseArrays(slot, directions)) return false;
  if (!blocks_[slot].is_vacant) {
    blocks_[slot].is_vacant = true;
    (blocks_[slot].extractions == extractions_ ? unmeshed_ : vacant_).push_back(slot);
  }
  return true;
}

std::vector<int32_t> BlockTable::takeVacant() {
  std::vector<int32_t> slots;
  vacant_.insert(vacant_.end(), unmeshed_.begin(), unmeshed_.end());
  for (const int32_t slot : vacant_) {
    // A block that has arrays again will be listed the next time it loses them.
    blocks_[slot].is_vacant = blocks_[slot].in_use && !hasArrays(slot);
    if (blocks_[slot].is_vacant) slots.push_back(slot);
  }
  vacant_.clear();
  unmeshed_.clear();
  return slots;
}

std::vector<int32_t> BlockTable::releaseVacant(const std::vector<int32_t>& slots) {
  std::vector<int32_t> released;
  for (const int32_t slot : slots) {
    blocks_[slot].is_vacant = false;
    if (!blocks_[slot].in_use || hasArrays(slot)) continue;
    releaseBlock(slot);
    released.push_back(slot);
  }
  return released;
}

/// @return whether the block has no arrays left.
bool BlockTable::releaseArrays(int32_t slot, uint32_t directions) {
  for (int d = 0; d < kDirectionCount; ++d) {
    int32_t& array = blocks_[slot].array[d];
    if (array == kNoArray || !(directions >> d & 1)) continue;
    releaseColours(array);
    free_arrays_.push_back(array);
    array = kNoArray;
    --arrays_in_use_;
  }
  return !hasArrays(slot);
}

void BlockTable::releaseBlock(int32_t slot) {
  slots_.erase(packKey(blocks_[slot].key));
  cells_.erase(blocks_[slot].key, slot);
  blocks_[slot].in_use = false;
  free_slots_.push_back(slot);
}

void BlockTable::clear() {
  const MapExtent extent = extent_;
  *this = BlockTable(budget_bytes_);
  extent_ = extent;
}

size_t BlockTable::bytesOf(int32_t slot) const {
  size_t bytes = kBlockBytes;
  for (const int32_t array : blocks_[static_cast<size_t>(slot)].array) {
    if (array == kNoArray) continue;
    bytes += kArrayBytes;
    for (int brick = 0; brick < kBricksPerArray; ++brick) {
      bytes += colourOf(array, brick) == kNoArray ? 0 : kColourBytes;
    }
  }
  return bytes;
}

double squaredDistance(const BlockKey& block, const Vec3d& p) {
  const auto outside = [](int32_t key, double at) {
    const double first = static_cast<double>(key) * kBlockSide, beyond = first + kBlockSide;
    return at < first ? first - at : (at > beyond ? at - beyond : 0.0);
  };
  const double x = outside(block.x, p.x), y = outside(block.y, p.y), z = outside(block.z, p.z);
  return x * x + y * y + z * z;
}

std::vector<int32_t> BlockTable::slotsIn(const RegionView& region) const {
  std::vector<int32_t> slots;
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const auto slot = static_cast<int32_t>(i);
    const BlockEntry& entry = blocks_[i];
    if (entry.in_use && mayBeInside(region, entry.key) && hasArrays(slot)) slots.push_back(slot);
  }
  return slots;
}

std::vector<int32_t> BlockTable::slotsInView(const FrameView& frame, float radius) const {
  std::vector<int32_t> slots;
  cells_.visitInView(frame, radius, [&](const BlockCells::Cell& cell) {
    slots.insert(slots.end(), cell.slots.begin(), cell.slots.end());
  });
  return slots;
}

std::vector<int32_t> BlockTable::slotsBeyond(const RegionView& kept) const {
  const double limit = kept.radius * kept.radius;
  std::vector<int32_t> beyond;
  for (const BlockCells::Cell& cell : cells_.all()) {
    if (squaredReach(cell, kept.center) <= limit) continue;  // all its blocks are inside
    for (const int32_t slot : cell.slots) {
      const bool is_far = squaredDistance(blocks_[slot].key, kept.center) > limit;
      if (is_far && hasArrays(slot)) beyond.push_back(slot);
    }
  }
  return beyond;
}

std::vector<int32_t> BlockTable::sortedSlots() const {
  std::vector<std::pair<PackedKey, int32_t>> entries;
  entries.reserve(slots_.size());
  for (size_t slot = 0; slot < blocks_.size(); ++slot) {
    if (!blocks_[slot].in_use) continue;
    entries.emplace_back(packKey(blocks_[slot].key), static_cast<int32_t>(slot));
  }
  std::sort(entries.begin(), entries.end());
  std::vector<int32_t> slots;
  slots.reserve(entries.size());
  for (const auto& [key, slot] : entries) slots.push_back(slot);
  return slots;
}

}  // namespace dtsdf
