#include "engine/pager.h"

#include <algorithm>
#include <utility>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "kernels/fusion/free_space.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

/// Of blocks that move at once, about: what is in memory twice meanwhile.
constexpr size_t kBatchBytes = size_t{8} << 20;

/// See spareBytes(): a share of the budget.
constexpr size_t kSpareShare = 16;
constexpr size_t kMostSpareBytes = 4 * kBatchBytes;

/// What waits to be written, beside the budget: a share of it.
constexpr size_t kWaitingShare = 8;
constexpr size_t kMostWaitingBytes = 4 * kBatchBytes;

/// After a failure, calls that leave the disk alone.
constexpr uint64_t kCallsBetweenTries = 16;

/// What is read of a block, at most.
constexpr size_t kLabelBytes = kVoxelsPerBlock * sizeof(UnitLabels);
constexpr size_t kMostBytesOfBlock =
    BlockTable::kBlockBytes +
    kDirectionCount * (BlockTable::kArrayBytes + kBricksPerArray * BlockTable::kColourBytes);

size_t bytesOnceIn(const MapBlock& block) {
  return BlockTable::kBlockBytes +
         static_cast<size_t>(__builtin_popcount(block.directions)) * BlockTable::kArrayBytes +
         static_cast<size_t>(__builtin_popcountll(block.bricks)) * BlockTable::kColourBytes;
}

}  // namespace

size_t bytesOfNew(const PoolSizes& lack) {
  return lack.slots * BlockTable::kBlockBytes + lack.arrays * BlockTable::kArrayBytes;
}

size_t spareBytes(size_t budget_bytes) {
  return std::min(budget_bytes / kSpareShare, kMostSpareBytes);
}

Pager::Pager(const MapperParams& params, const Rules& rules, int threads, BlockTable& table)
    : params_(params),
      fusion_rules_(rules.fusion),
      threads_(threads),
      table_(table),
      blocks_(params.map.page_folder, pageBytesOf(params.map),
              std::min(table.budgetBytes() / kWaitingShare, kMostWaitingBytes)) {}

size_t Pager::bytesOf(PackedKey key) const {
  const int32_t slot = table_.find(key);
  if (slot >= 0) return table_.bytesOf(slot);
  const int32_t number = blocks_.find(key);
  return number < 0 ? 0 : bytesOnceIn(blocks_.block(number).block);
}

bool Pager::fits(const std::vector<PackedKey>& keys, size_t other_bytes) const {
  size_t bytes = other_bytes;
  if (bytes + keys.size() * kMostBytesOfBlock <= table_.budgetBytes()) return true;
  for (const PackedKey key : keys) bytes += bytesOf(key);
  return bytes <= table_.budgetBytes();
}

void Pager::touch(int32_t slot) {
  const auto place = static_cast<size_t>(slot);
  if (last_need_.size() <= place) last_need_.resize(table_.slotCount(), 0);
  last_need_[place] = now_;
  table_.noteNeed(table_.block(slot).key, now_);
}

void Pager::noteNew(const std::vector<int32_t>& slots) {
  for (const int32_t slot : slots) touch(slot);
}

std::vector<int32_t> Pager::numbersOf(const std::vector<PackedKey>& keys) const {
  std::vector<int32_t> numbers;
  if (isEmpty()) return numbers;
  for (const PackedKey key : keys) {
    if (const int32_t number = blocks_.find(key); number >= 0) numbers.push_back(number);
  }
  return numbers;
}

bool Pager::isAnyPaged(const std::vector<PackedKey>& keys) const {
  return !isEmpty() &&
         std::any_of(keys.begin(), keys.end(), [this](auto key) { return isPaged(key); });
}

size_t Pager::require(MapBackend& backend, const std::vector<PackedKey>& keys) {
  ++now_;
  for (const PackedKey key : keys) {
    if (const int32_t slot = table_.find(key); slot >= 0) touch(slot);
  }
  const std::vector<int32_t> numbers = numbersOf(keys);
  for (const int32_t number : numbers) blocks_.readAhead(number);
  size_t left = 0;
  for (size_t first = 0; first < numbers.size();) {
    size_t end = first, bytes = 0;
    for (; end < numbers.size() && (end == first || bytes < kBatchBytes); ++end) {
      bytes += bytesOnceIn(blocks_.block(numbers[end]).block);
    }
    makeRoom(backend, bytes, Reserve::kUse);
    while (end > first && !hasRoom(bytes)) {
      bytes -= bytesOnceIn(blocks_.block(numbers[--end]).block);
    }
    if (end == first) return left + numbers.size() - first;
    const size_t staying = readBatch(backend, {numbers.begin() + static_cast<std::ptrdiff_t>(first),
                                               numbers.begin() + static_cast<std::ptrdiff_t>(end)});
    // Nothing leaves memory for what does not come.
    if (staying == end - first) no_writing_before_ = now_ + kCallsBetweenTries;
    left += staying;
    first = end;
  }
  return left;
}

bool Pager::makeRoom(MapBackend& backend, size_t bytes) {
  return makeRoom(backend, bytes, Reserve::kLeave);
}

/// Some more than that, unless the reserve of the disk has to be used for it.
bool Pager::makeRoom(MapBackend& backend, size_t bytes, Reserve reserve) {
  if (hasRoom(bytes)) return true;
  evict(backend, bytes + spareBytes(table_.budgetBytes()), Reserve::kLeave, now_ + 1);
  if (!hasRoom(bytes) && reserve == Reserve::kUse) evict(backend, bytes, reserve, now_ + 1);
  return hasRoom(bytes);
}

/// Until there is room for so many bytes, or nothing more can go. Batches get smaller where the
/// disk has little room, so that it is used up to the last block.
/// @param before Only what lies where nothing was needed since then.
void Pager::evict(MapBackend& backend, size_t bytes, Reserve reserve, uint64_t before) {
  if (now_ < no_writing_before_) return;
  const std::vector<int32_t> slots =
      leastRecent(table_.bytesInUse() + bytes - table_.budgetBytes(), before);
  std::vector<int32_t> batch;
  size_t batch_bytes = 0;
  for (size_t i = 0; i < slots.size(); ++i) {
    batch.push_back(slots[i]);
    batch_bytes += table_.bytesOf(slots[i]);
    const uint64_t room = roomOnDisk(reserve);
    if (batch_bytes < std::min<uint64_t>(kBatchBytes, room / 4) && i + 1 < slots.size()) continue;
    if (batch_bytes + batch.size() * kLabelBytes > room) return blocks_.store().countFull();
    if (!writeBatch(backend, batch)) {
      no_writing_before_ = now_ + kCallsBetweenTries;
      return;
    }
    batch.clear();
    batch_bytes = 0;
  }
}

/// An eighth of the disk is left for what makes room for blocks that come back: a full disk would
/// hold on to these else.
uint64_t Pager::roomOnDisk(Reserve reserve) const {
  constexpr uint64_t kMostReserve = uint64_t{32} << 20;
  const uint64_t room = blocks_.store().room();
  const uint64_t left = std::min<uint64_t>(pageBytesOf(params_.map) / 8, kMostReserve);
  return reserve == Reserve::kUse ? room : room - std::min(room, left);
}

/// Blocks that were not required last, at least so many bytes of them if there are: coarse cell by
/// coarse cell, those that were needed least recently first, by key those of the same time.
std::vector<int32_t> Pager::leastRecent(size_t bytes, uint64_t before) const {
  std::vector<const BlockCells::Cell*> cells;
  for (const BlockCells::Cell& cell : table_.cells()) {
    if (cell.last_need < before) cells.push_back(&cell);
  }
  std::sort(cells.begin(), cells.end(), [](const auto* a, const auto* b) {
    return a->last_need != b->last_need ? a->last_need < b->last_need
                                        : packKey(a->key) < packKey(b->key);
  });
  std::vector<int32_t> slots;
  size_t found = 0;
  for (const BlockCells::Cell* cell : cells) {
    for (const int32_t slot : cell->slots) {
      if (found >= bytes) return slots;
      const auto place = static_cast<size_t>(slot);
      const bool is_needed = place < last_need_.size() && last_need_[place] == now_;
      if (is_needed || directionsWithArrays(table_.block(slot)) == 0) continue;
      found += table_.bytesOf(slot);
      slots.push_back(slot);
    }
  }
  return slots;
}

std::vector<FramePart> Pager::partsOf(MapBackend& backend, const FrameView& view,
                                      TouchedBlocks touched, std::vector<int32_t> in_view,
                                      uint64_t frame_number) const {
  const bool moves = !hasRoom(bytesOfNew({touched.requests.size(), touched.new_arrays})) ||
                     std::any_of(touched.requests.begin(), touched.requests.end(),
                                 [this](const BlockRequest& one) { return isPaged(one.key); });
  std::vector<PackedKey> others;
  if (clearsFreeSpace(params_) && !isEmpty()) {
    const BlockKey origin = blockOfVoxel(view.origin_voxel);
    others = blocks_.keysInView(view, kFootRadius, [](const BlockCells::Cell&) { return true; });
    const auto is_unseen = [&](PackedKey key) {
      return !isInTurn(key, frame_number, fusion_rules_) ||
             !mayBeInView(view, unpackKey(key) - origin);
    };
    others.erase(std::remove_if(others.begin(), others.end(), is_unseen), others.end());
  }
  if (!moves && others.empty()) return {FramePart::whole(std::move(in_view), std::move(touched))};
  for (const int32_t slot : in_view) {
    if (table_.block(slot).in_use) others.push_back(packKey(table_.block(slot).key));
  }
  std::vector<PackedKey> keys = backend.neededKeys(others, frame_number);
  keepEachOnce(keys);
  if (!moves && !isAnyPaged(keys)) {
    return {FramePart::whole(std::move(in_view), std::move(touched))};
  }
  return split(keys, std::move(touched.requests));
}

/// By key: each block with all that is asked for of it.
std::vector<FramePart> Pager::split(const std::vector<PackedKey>& keys,
                                    std::vector<BlockRequest> requests) const {
  const size_t most_bytes = table_.budgetBytes() - table_.budgetBytes() / 8;
  std::sort(requests.begin(), requests.end(),
            [](const BlockRequest& a, const BlockRequest& b) { return a.key < b.key; });
  std::vector<FramePart> parts(1);
  size_t bytes = 0;
  auto next = requests.begin();
  for (const PackedKey key : keys) {
    size_t wanted = 0;
    const auto first = next;
    for (; next != requests.end() && next->key <= key; ++next) {
      const uint32_t known = directionsOf(next->key);
      wanted += bytesOfNew({known == 0 ? size_t{1} : 0,
                            static_cast<size_t>(__builtin_popcount(next->directions & ~known))});
    }
    const size_t had = bytesOf(key);
    if (!parts.back().keys.empty() && bytes + had + wanted > most_bytes) {
      parts.emplace_back();
      bytes = 0;
    }
    FramePart& part = parts.back();
    part.keys.push_back(key);
    part.requests.insert(part.requests.end(), first, next);
    bytes += had + wanted;
  }
  for (FramePart& part : parts) part.is_whole = parts.size() == 1;
  return parts;
}

/// Directions that it has voxels of.
uint32_t Pager::directionsOf(PackedKey key) const {
  if (const int32_t slot = table_.find(key); slot >= 0) {
    return directionsWithArrays(table_.block(slot));
  }
  const int32_t number = blocks_.find(key);
  return number < 0 ? 0 : blocks_.block(number).block.directions;
}

void Pager::clear() {
  blocks_.clear();
  last_need_.clear();
  T_W_C_before_.reset();
  ahead_of_.reset();
  ahead_.clear();
  dropped_.clear();
  next_ahead_ = ahead_at_once_ = 0;
  kept_since_ = ahead_now_ = no_writing_before_ = 0;
  frames_ = written_ = read_ = 0;
}

PageStats Pager::stats() const {
  PageStats stats = blocks_.store().stats();
  stats.blocks = blocks_.count();
  stats.index_bytes += blocks_.indexBytes();
  stats.written = written_;
  stats.read = read_;
  return stats;
}

}  // namespace dtsdf
