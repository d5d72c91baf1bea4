// How blocks go to the disk and come back, and what of the map lies there.
#include <algorithm>
#include <cstring>
#include <new>
#include <stdexcept>
#include <utility>

#include "engine/pager.h"
#include "kernels/core/direction.h"
#include "map/map_head.h"

namespace dtsdf {
namespace {

constexpr size_t kMostRecordBytes =
    kVoxelsPerBlock *
    (kDirectionCount * (sizeof(Voxel) + sizeof(VoxelColour)) + sizeof(UnitLabels));

/// Where a block's words are, block by block.
struct Words {
  uint64_t* voxels;
  uint32_t* colours;
  UnitLabels* labels;

  /// Copies a record there, and moves on; null: 0.
  void take(const MapBlock& block, bool has_labels, const char* record) {
    move(voxels, voxelWordsOf(block), record);
    move(colours, colourWordsOf(block), record);
    move(labels, has_labels ? kVoxelsPerBlock : 0, record);
  }
  /// Copies them into a record, and moves on.
  void put(const MapBlock& block, bool has_labels, std::vector<char>& record) {
    record.clear();
    append(voxels, voxelWordsOf(block), record);
    append(colours, colourWordsOf(block), record);
    append(labels, has_labels ? kVoxelsPerBlock : 0, record);
  }

 private:
  template <class T>
  static void move(T*& to, size_t count, const char*& record) {
    if (to == nullptr || count == 0) return;
    if (record == nullptr) {
      std::memset(to, 0, count * sizeof(T));
    } else {
      std::memcpy(to, record, count * sizeof(T));
      record += count * sizeof(T);
    }
    to += count;
  }
  template <class T>
  static void append(T*& from, size_t count, std::vector<char>& record) {
    const auto* const bytes = reinterpret_cast<const char*>(from);
    record.insert(record.end(), bytes, bytes + count * sizeof(T));
    from += count;
  }
};

}  // namespace

std::vector<int32_t> enterContents(const MapContents& contents, const MeshStates* states,
                                   BlockTable& table, MapBackend& backend) {
  const MapSize size = sizeOf(contents.blocks);
  const bool has_colours = size.bricks > 0 || contents.painted;
  backend.reserve(
      {{size.blocks, size.voxel_arrays, table.sizesAfter(size.blocks, size.voxel_arrays)},
       size.bricks,
       has_colours,
       states == nullptr ? 0 : size.blocks});
  const EnteredBlocks entered = enterBlocks(contents.blocks, table);
  const std::vector<int32_t>& slots = entered.blocks.changed_slots;
  backend.follow({slots, false, &entered.blocks.new_arrays, &entered.colours.bricks});
  backend.copyIn(entered.order(), contents, states);
  return slots;
}

/// @return whether they are released; else some or all are as they were.
bool Pager::writeBatch(MapBackend& backend, const std::vector<int32_t>& slots) {
  const DiskWait wait(blocks_.store());
  MemoryDemand demand;
  demand.changed = slots.size();
  backend.reserve(demand);
  MapContents contents;
  contents.blocks = mapBlocks(table_, slots);
  makeRoomForWords(contents);
  MeshStates states;
  std::vector<char> record;
  record.reserve(kMostRecordBytes);  // nothing lacks memory once the states are taken
  backend.copyOut(orderOf(table_, slots), contents, &states);
  Words words{contents.voxels.data(), contents.colours.data(), states.labels.data()};
  const UnitLabels* labels = words.labels;  // of the first one that stays
  MeshStates left;
  std::vector<int32_t> released;
  for (size_t i = 0; i < slots.size(); ++i) {
    const MeshState& state = states.states[i];
    labels = words.labels;
    words.put(contents.blocks[i], state.has_labels, record);
    const PagedBlock block{contents.blocks[i], table_.block(slots[i]).extractions,
                           state.marks.dirty,  state.marks.painted,
                           state.has_mesh,     state.has_labels};
    if (!blocks_.put(block, record.data(), record.size())) break;
    released.push_back(slots[i]);
  }
  const std::vector<int32_t> staying(slots.begin() + static_cast<std::ptrdiff_t>(released.size()),
                                     slots.end());
  if (!staying.empty()) {
    left.states.assign(states.states.end() - static_cast<std::ptrdiff_t>(staying.size()),
                       states.states.end());
    const UnitLabels* const end = states.labels.data() + states.labels.size();
    left.labels = PlainArray<UnitLabels>(static_cast<size_t>(end - labels));
    std::copy(labels, end, left.labels.data());
    backend.copyIn({{}, {}, staying}, MapContents(), &left);
  }
  for (const int32_t slot : released) table_.release(slot, kAllDirections);
  backend.follow({released});
  written_ += released.size();
  return staying.empty();
}

/// What the disk does not give stays there. @pre There is room for them. @return how many stay.
size_t Pager::readBatch(MapBackend& backend, std::vector<int32_t> numbers) {
  const DiskWait wait(blocks_.store());
  std::sort(numbers.begin(), numbers.end(),
            [this](int32_t a, int32_t b) { return blocks_.keyOf(a) < blocks_.keyOf(b); });
  MapContents contents;
  for (const int32_t number : numbers) contents.blocks.push_back(blocks_.block(number).block);
  makeRoomForWords(contents);
  contents.blocks.clear();
  MeshStates states;
  states.labels = PlainArray<UnitLabels>(numbers.size() * kVoxelsPerBlock);
  Words words{contents.voxels.data(), contents.colours.data(), states.labels.data()};
  std::vector<char> record;
  std::vector<int32_t> read;
  std::vector<uint32_t> extractions;
  std::vector<PackedKey> damaged;
  for (const int32_t number : numbers) {
    const PagedBlock& block = blocks_.block(number);
    record.resize(blocks_.recordBytes(number));
    const RecordStore::Reading reading = blocks_.read(number, record.data());
    if (reading == RecordStore::Reading::kDamaged) damaged.push_back(blocks_.keyOf(number));
    if (reading != RecordStore::Reading::kIntact) continue;
    words.take(block.block, block.has_labels, record.data());
    contents.blocks.push_back(block.block);
    states.states.push_back({{block.dirty, block.painted}, block.has_mesh, block.has_labels});
    extractions.push_back(block.extractions);
    read.push_back(number);
  }
  const size_t left = numbers.size() - read.size() - damaged.size();
  if (!read.empty()) {
    const std::vector<int32_t> slots = enterContents(contents, &states, table_, backend);
    for (size_t i = 0; i < slots.size(); ++i) {
      table_.setExtractions(slots[i], extractions[i]);
      touch(slots[i]);
    }
  }
  for (const int32_t number : read) blocks_.erase(number);
  read_ += read.size();
  drop(backend, damaged);
  return left;
}

void Pager::drop(MapBackend& backend, const std::vector<PackedKey>& keys) {
  if (keys.empty()) return;
  for (const int32_t number : numbersOf(keys)) blocks_.erase(number);
  dropped_.insert(dropped_.end(), keys.begin(), keys.end());
  no_writing_before_ = 0;  // there may be room on the disk now
  std::vector<MarkedKey> around;
  for (const PackedKey key : blocksAround(keys)) around.push_back({key, {true, false}});
  setMarks(backend, around);
}

MeshUpdate Pager::takeDropped() {
  keepEachOnce(dropped_);
  MeshUpdate update;
  for (const PackedKey key : dropped_) {
    update.blocks.emplace_back();
    update.blocks.back().key = unpackKey(key);
  }
  dropped_.clear();
  return update;
}

void Pager::markAll(const MeshMarks& marks) {
  for (const int32_t number : numbersOf(allPaged())) {
    const PagedBlock& block = blocks_.block(number);
    blocks_.setMarks(number, block.dirty || marks.dirty,
                     block.painted || (marks.painted && block.has_mesh));
  }
}

std::vector<PackedKey> Pager::allPaged() const {
  return blocks_.keysWhere([](const auto&) { return true; }, [](int32_t) { return true; });
}

std::vector<MarkedKey> Pager::marked(MapBackend& backend, bool taken) {
  std::vector<MarkedKey> all;
  for (const MarkedSlot& one : backend.marked(taken)) {
    all.push_back({packKey(table_.block(one.slot).key), one.marks});
  }
  if (!hasMarks()) return all;
  for (const int32_t number : numbersOf(allPaged())) {
    const PagedBlock& block = blocks_.block(number);
    if (!block.dirty && !block.painted) continue;
    all.push_back({blocks_.keyOf(number), {block.dirty, block.painted}});
    if (taken) blocks_.setMarks(number, false, false);
  }
  return all;
}

void Pager::setMarks(MapBackend& backend, const std::vector<MarkedKey>& marked) {
  std::vector<MarkedSlot> slots;
  for (const auto& [key, marks] : marked) {
    const int32_t slot = table_.find(key), number = slot < 0 ? blocks_.find(key) : -1;
    if (slot >= 0) slots.push_back({slot, marks});
    if (number < 0) continue;
    const PagedBlock& block = blocks_.block(number);
    blocks_.setMarks(number, block.dirty || marks.dirty, block.painted || marks.painted);
  }
  backend.setMarks(slots);
}

void Pager::addBlocksTo(MapContents& contents) const {
  for (const int32_t number : numbersOf(allPaged())) {
    contents.blocks.push_back(blocks_.block(number).block);
  }
  std::sort(contents.blocks.begin(), contents.blocks.end(),
            [](const auto& a, const auto& b) { return packKey(a.key) < packKey(b.key); });
}

/// Some at a time: what is in memory is copied by the backend, in its order.
void Pager::copyWords(MapBackend& backend, MapContents& contents) {
  constexpr size_t kAtOnce = 1024;
  Words words{contents.voxels.data(), contents.colours.data(), nullptr};
  std::vector<PackedKey> damaged;
  std::vector<char> record;
  for (size_t first = 0; first < contents.blocks.size(); first += kAtOnce) {
    const size_t end = std::min(contents.blocks.size(), first + kAtOnce);
    std::vector<int32_t> slots;
    for (size_t i = first; i < end; ++i) {
      const PackedKey key = packKey(contents.blocks[i].key);
      if (const int32_t slot = table_.find(key); slot >= 0) slots.push_back(slot);
    }
    MapContents in_memory;
    in_memory.blocks = mapBlocks(table_, slots);
    makeRoomForWords(in_memory);
    backend.copyOut(orderOf(table_, slots), in_memory);
    Words from{in_memory.voxels.data(), in_memory.colours.data(), nullptr};
    for (size_t i = first; i < end; ++i) {
      const MapBlock& block = contents.blocks[i];
      const PackedKey key = packKey(block.key);
      const int32_t slot = table_.find(key), number = slot < 0 ? blocks_.find(key) : -1;
      if (slot >= 0 && directionsWithArrays(table_.block(slot)) != 0) {
        from.put(block, false, record);
      } else if (number < 0 || !readInto(number, record)) {  // it is damaged, or turned out to be
        if (number >= 0) damaged.push_back(key);
        words.take(block, false, nullptr);
        continue;
      }
      words.take(block, false, record.data());
    }
  }
  drop(backend, damaged);
}

/// @return whether it is intact. @throws std::runtime_error where it cannot be read now.
bool Pager::readInto(int32_t number, std::vector<char>& record) {
  record.resize(blocks_.recordBytes(number));
  const RecordStore::Reading reading = blocks_.read(number, record.data());
  if (reading == RecordStore::Reading::kUnreadable) {
    throw std::runtime_error("the map cannot be copied: " + blocks_.store().stats().problem);
  }
  return reading == RecordStore::Reading::kIntact;
}

}  // namespace dtsdf
