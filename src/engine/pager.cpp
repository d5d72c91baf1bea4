#include "engine/pager.h"

#include <algorithm>
#include <utility>

#include "engine/block_records.h"
#include "kernels/core/direction.h"
#include "kernels/meshing/unit_samples.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

/// Of blocks that move at once, about: what is in memory twice meanwhile.
constexpr size_t kBatchBytes = size_t{8} << 20;

/// See spareBytes(): a share of the budget.
constexpr size_t kSpareShare = 16;
constexpr size_t kMostSpareBytes = 4 * kBatchBytes;

/// What waits to be written, and what was read ahead, each: a share of the budget beside it.
constexpr size_t kQueueShare = 8;
constexpr size_t kMostQueueBytes = 4 * kBatchBytes;

size_t queueBytesOf(size_t budget_bytes) {
  return std::min(budget_bytes / kQueueShare, kMostQueueBytes);
}

/// After a failure, calls that leave the disk alone.
constexpr uint64_t kCallsBetweenTries = 16;

}  // namespace

size_t spareBytes(size_t budget_bytes) {
  return std::min(budget_bytes / kSpareShare, kMostSpareBytes);
}

Pager::Pager(const MapParams& params, BlockTable& table, std::function<void()> finish_meshes)
    : table_(table),
      finish_meshes_(std::move(finish_meshes)),
      store_(params.page_folder, pageBytesOf(params), queueBytesOf(table.budgetBytes())) {}

size_t Pager::bytesOnceIn(const PagedBlock& block) const {
  return BlockTable::kBlockBytes +
         static_cast<size_t>(__builtin_popcount(block.directions)) * BlockTable::kArrayBytes +
         static_cast<size_t>(__builtin_popcountll(block.bricks)) * BlockTable::kColourBytes;
}

size_t Pager::bytesOf(PackedKey key) const {
  const int32_t slot = table_.find(key);
  if (slot >= 0) return table_.bytesOf(slot);
  const int32_t number = store_.find(key);
  return number < 0 ? 0 : bytesOnceIn(store_.block(number));
}

uint32_t Pager::directionsInMemory(PackedKey key) const {
  const int32_t slot = table_.find(key);
  return slot < 0 ? 0 : directionsWithArrays(table_.block(slot));
}

uint32_t Pager::directionsOf(PackedKey key) const {
  if (table_.find(key) >= 0) return directionsInMemory(key);
  const int32_t number = store_.find(key);
  return number < 0 ? 0 : store_.block(number).directions;
}

std::vector<int32_t> Pager::numbersOf(const std::vector<PackedKey>& keys) const {
  std::vector<int32_t> numbers;
  for (const PackedKey key : keys) {
    if (const int32_t number = store_.find(key); number >= 0) numbers.push_back(number);
  }
  return numbers;
}

void Pager::readAhead(MapBackend& backend, std::vector<PackedKey> keys, size_t calls) {
  store_.readAhead(numbersOf(keys), backend.mover()->recordsMaker());
  ahead_ = std::move(keys);
  next_ahead_ = 0;
  ahead_at_once_ = calls == 0 ? 0 : (ahead_.size() + calls - 1) / calls;
  ahead_since_ = std::exchange(ahead_now_, now_);
}

void Pager::moveAhead(MapBackend& backend) {
  const size_t spare = spareBytes(table_.budgetBytes());
  if (!hasRoom(spare)) writeOut(backend, spare, Reserve::kLeave, Which::kNotAhead);
  const size_t end = std::min(ahead_.size(), next_ahead_ + ahead_at_once_);
  if (next_ahead_ == end) return;
  const auto at = [this](size_t i) { return ahead_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::vector<int32_t> numbers = numbersOf({at(next_ahead_), at(end)});
  const size_t count = store_.countInMemory(numbers);
  if (count == numbers.size()) next_ahead_ = end;
  numbers.resize(count);
  size_t bytes = 0;
  for (const int32_t number : numbers) bytes += bytesOnceIn(store_.block(number));
  if (!numbers.empty() && hasRoom(bytes)) readBatch(backend, std::move(numbers));
}

void Pager::noteNew(const std::vector<int32_t>& slots) {
  for (const int32_t slot : slots) touch(slot);
}

size_t Pager::mostAhead() const {
  return spareBytes(table_.budgetBytes()) / (BlockTable::kBlockBytes + BlockTable::kArrayBytes);
}

size_t Pager::bringIn(MapBackend& backend, const std::vector<PackedKey>& keys, size_t new_bytes) {
  ++now_;
  std::vector<int32_t> numbers;
  for (const PackedKey key : keys) {
    const int32_t slot = table_.find(key);
    const int32_t number = slot < 0 ? store_.find(key) : -1;
    if (slot >= 0) touch(slot);
    if (number >= 0) numbers.push_back(number);
  }
  const size_t left = readSome(backend, numbers);
  makeRoom(backend, new_bytes);
  return left;
}

/// As far as there is room for them. @return how many stay on disk.
size_t Pager::readSome(MapBackend& backend, const std::vector<int32_t>& numbers) {
  size_t unreadable = 0;
  for (size_t first = 0; first < numbers.size();) {
    size_t end = first, bytes = 0;
    for (; end < numbers.size() && (end == first || bytes < kBatchBytes); ++end) {
      bytes += bytesOnceIn(store_.block(numbers[end]));
    }
    makeRoom(backend, bytes, Reserve::kUse);
    while (end > first && !hasRoom(bytes)) bytes -= bytesOnceIn(store_.block(numbers[--end]));
    if (end == first) return unreadable + numbers.size() - first;
    unreadable += readBatch(backend, {numbers.begin() + static_cast<std::ptrdiff_t>(first),
                                      numbers.begin() + static_cast<std::ptrdiff_t>(end)});
    first = end;
  }
  return unreadable;
}

bool Pager::makeRoom(MapBackend& backend, size_t bytes) {
  return makeRoom(backend, bytes, Reserve::kLeave);
}

/// Some more than that, unless the reserve of the disk has to be used for it.
bool Pager::makeRoom(MapBackend& backend, size_t bytes, Reserve reserve) {
  if (hasRoom(bytes)) return true;
  writeOut(backend, bytes + spareBytes(table_.budgetBytes()), Reserve::kLeave);
  if (!hasRoom(bytes) && reserve == Reserve::kUse) writeOut(backend, bytes, reserve);
  return hasRoom(bytes);
}

/// Until there is room for so many bytes, or nothing more can go. Two batches fit into the queue,
/// and batches get smaller where the disk has little room, so that it is used up to the last block.
void Pager::writeOut(MapBackend& backend, size_t bytes, Reserve reserve, Which which) {
  const bool use_reserve = reserve == Reserve::kUse;
  if (now_ < no_writing_before_ || store_.isFull(use_reserve)) return;
  const std::vector<int32_t> slots =
      leastRecent(table_.bytesInUse() + bytes - table_.budgetBytes(), which);
  if (slots.empty()) return;
  finish_meshes_();
  const size_t most_bytes = std::min(kBatchBytes, queueBytesOf(table_.budgetBytes()) / 2);
  std::vector<int32_t> batch;
  size_t batch_bytes = 0;
  for (size_t i = 0; i < slots.size(); ++i) {
    batch.push_back(slots[i]);
    batch_bytes += table_.bytesOf(slots[i]);
    const uint64_t most = std::min<uint64_t>(most_bytes, store_.room(use_reserve) / 4);
    if (batch_bytes < most && i + 1 < slots.size()) continue;
    if (!writeBatch(backend, batch, reserve)) return;
    batch.clear();
    batch_bytes = 0;
  }
}

/// @return whether they have gone; else they are as they were.
bool Pager::writeBatch(MapBackend& backend, const std::vector<int32_t>& slots, Reserve reserve) {
  size_t most_bytes = slots.size() * kVoxelsPerBlock * sizeof(UnitLabels);
  for (const int32_t slot : slots) most_bytes += table_.bytesOf(slot);
  if (!store_.hasRoomFor(most_bytes, reserve == Reserve::kUse)) {
    ++stats_.failures;
    return false;
  }
  backend.reserveChanges(slots.size());
  std::vector<PagedBlock> blocks(slots.size());
  std::vector<ArrivingBlock> staying(slots.size());
  const LeavingBlocks leaving = backend.mover()->takeOut(slots);
  size_t begin = 0;
  for (size_t i = 0; i < slots.size(); ++i) {
    blocks[i] = pagedBlockOf(mapBlockOf(table_, slots[i]), leaving.states[i],
                             table_.block(slots[i]).extractions);
    staying[i] = {leaving.states[i], {leaving.records, begin}};
    begin += recordBytes(blocks[i]);
  }
  if (!store_.write(blocks, leaving.records)) {  // or memory lacks: as where the disk is full
    backend.mover()->putIn(slots, staying);
    ++stats_.failures;
    no_writing_before_ = now_ + kCallsBetweenTries;
    return false;
  }
  for (const int32_t slot : slots) table_.release(slot, kAllDirections);
  backend.follow({slots, false});
  stats_.written += slots.size();
  return true;
}

/// What the disk does not give stays there. @pre There is room for them. @return how many stay.
size_t Pager::readBatch(MapBackend& backend, std::vector<int32_t> numbers) {
  finish_meshes_();
  std::sort(numbers.begin(), numbers.end(),
            [this](int32_t a, int32_t b) { return store_.block(a).key < store_.block(b).key; });
  std::vector<RecordPlace> places;
  const std::vector<uint8_t> readings =
      store_.fetch(numbers, backend.mover()->recordsMaker(), places);
  std::vector<PagedBlock> blocks;
  std::vector<ArrivingBlock> arriving;
  std::vector<int32_t> damaged, gone;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (readings[i] == kPageDamaged) damaged.push_back(numbers[i]);
    if (readings[i] != kPageIntact) continue;
    gone.push_back(numbers[i]);
    blocks.push_back(store_.block(numbers[i]));
    arriving.push_back({meshStateOf(blocks.back()), std::move(places[i])});
  }
  const size_t left = numbers.size() - gone.size() - damaged.size();
  if (left > 0) ++stats_.failures;
  enter(backend, blocks, arriving);
  store_.release(gone);
  stats_.read += blocks.size();
  lose(backend, damaged);
  return left;
}

/// As a map that is loaded does: memory first, then the table, then what the backend knows of it.
void Pager::enter(MapBackend& backend, const std::vector<PagedBlock>& blocks,
                  const std::vector<ArrivingBlock>& arriving) {
  if (blocks.empty()) return;
  std::vector<MapBlock> map_blocks;
  map_blocks.reserve(blocks.size());
  for (const PagedBlock& block : blocks) map_blocks.push_back(mapBlockOf(block));
  const MapSize size = sizeOf(map_blocks);
  backend.reserve(
      {size.blocks, size.voxel_arrays, table_.sizesAfter(size.blocks, size.voxel_arrays)});
  if (size.bricks > 0) backend.reserveColours(size.bricks);
  backend.mover()->reserve(size);
  const EnteredBlocks entered = enterBlocks(map_blocks, table_);
  const std::vector<int32_t>& slots = entered.blocks.changed_slots;
  backend.enterBlocks(slots, entered.blocks.new_arrays);  // which may have had colours
  if (size.bricks > 0) backend.enterColours(entered.colours.bricks);
  backend.mover()->putIn(slots, arriving);
  for (size_t i = 0; i < slots.size(); ++i) {
    table_.setExtractions(slots[i], blocks[i].extractions);
    touch(slots[i]);
  }
}

/// What shows meshes of them learns from these that they have none; of others nobody knows.
std::vector<int32_t> Pager::enterWithoutVoxels(MapBackend& backend,
                                               const std::vector<PagedBlock>& blocks) {
  std::vector<BlockRequest> requests;
  std::vector<uint32_t> extractions;
  std::vector<ArrivingBlock> arriving;
  for (const PagedBlock& block : blocks) {
    if (block.extractions == table_.extractions()) continue;
    requests.push_back({block.key, 0});
    extractions.push_back(block.extractions);
    arriving.push_back({{{}, block.has_mesh, false}, {}});
  }
  const size_t room = (table_.budgetBytes() - table_.bytesInUse()) / BlockTable::kBlockBytes;
  if (requests.size() > room) requests.resize(room);  // of the rest, meshes stay as they were
  if (requests.empty()) return {};
  extractions.resize(requests.size());
  arriving.resize(requests.size());
  backend.reserve({requests.size(), 0, table_.sizesAfter(requests.size(), 0)});
  backend.mover()->reserve({requests.size(), 0, 0, 0});
  std::vector<int32_t> slots = table_.admit(std::move(requests)).changed_slots;
  backend.enterBlocks(slots, {});
  backend.mover()->putIn(slots, arriving);
  for (size_t i = 0; i < slots.size(); ++i) table_.setExtractions(slots[i], extractions[i]);
  return slots;
}

std::vector<int32_t> Pager::drop(MapBackend& backend, const std::vector<PackedKey>& keys) {
  std::vector<PackedKey> sorted = keys;
  std::sort(sorted.begin(), sorted.end());
  std::vector<PagedBlock> blocks;
  std::vector<int32_t> numbers;
  for (const PackedKey key : sorted) {
    numbers.push_back(store_.find(key));
    blocks.push_back(store_.block(numbers.back()));
  }
  finish_meshes_();
  std::vector<int32_t> slots = enterWithoutVoxels(backend, blocks);  // without memory, all stay
  store_.release(numbers);
  if (!numbers.empty()) no_writing_before_ = 0;  // there may be room on the disk now
  return slots;
}

/// The reserve of the disk may be used: what is dropped makes room there.
size_t Pager::canDrop(MapBackend& backend, const std::vector<PackedKey>& keys) {
  const auto has_mesh = [this](PackedKey key) {
    return store_.block(store_.find(key)).extractions != table_.extractions();
  };
  const auto meshed = static_cast<size_t>(std::count_if(keys.begin(), keys.end(), has_mesh));
  makeRoom(backend, meshed * BlockTable::kBlockBytes, Reserve::kUse);
  size_t room = (table_.budgetBytes() - table_.bytesInUse()) / BlockTable::kBlockBytes;
  const auto lacks_room = [&](PackedKey key) { return has_mesh(key) && room-- == 0; };
  return static_cast<size_t>(std::find_if(keys.begin(), keys.end(), lacks_room) - keys.begin());
}

void Pager::clear() {
  store_.clear();
  stats_ = PageStats();
  waits_before_ = store_.waits();
  last_need_.clear();
  ahead_.clear();
  next_ahead_ = ahead_at_once_ = 0;
  ahead_since_ = ahead_now_ = 0;
  no_writing_before_ = 0;
}

PageStats Pager::stats() const {
  PageStats stats = stats_;
  stats.blocks = store_.count();
  stats.bytes = store_.bytes();
  stats.index_bytes = store_.indexBytes();
  stats.problem = store_.problem();
  stats.waits = store_.waits().count - waits_before_.count;
  stats.wait_ms = store_.waits().ms - waits_before_.ms;
  return stats;
}

}  // namespace dtsdf
