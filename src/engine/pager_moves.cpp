// The part of Pager that reads and writes blocks, and changes the state of blocks on disk.
#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "engine/pager.h"
#include "kernels/core/direction.h"
#include "map/map_head.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

using Reading = RecordStore::Reading;

/// Number of blocks that a thread reads at a time.
constexpr size_t kReadAtOnce = 16;

/// Iterates over the blocks of `contents` and returns the words of each.
struct Words {
  uint64_t* voxels;
  uint32_t* colours;
  UnitLabels* labels;

  explicit Words(MapContents& contents, MeshStates* states = nullptr)
      : voxels(contents.voxels.data()),
        colours(contents.colours.data()),
        labels(states == nullptr ? nullptr : states->labels.data()) {}

  /// Returns the words of a block as a record, and advances to the next block.
  RecordBytes next(const MapBlock& block, bool has_labels,
                   std::shared_ptr<const void> owner = nullptr) {
    return {std::move(owner),
            {next(voxels, voxelWordsOf(block)), next(colours, colourWordsOf(block)),
             next(labels, has_labels ? kVoxelsPerBlock : 0)}};
  }

 private:
  template <class T>
  static std::string_view next(T*& words, size_t count) {
    if (words == nullptr || count == 0) return {};
    words += count;
    return {reinterpret_cast<const char*>(words - count), count * sizeof(T)};
  }
};

/// Copies bytes into the pieces of a record. @param from Source; if null, fills the pieces with 0.
void fill(const RecordBytes& to, const char* from) {
  for (const std::string_view piece : to.pieces) {
    char* const words = const_cast<char*>(piece.data());
    if (from == nullptr) {
      std::fill_n(words, piece.size(), 0);
    } else {
      std::copy_n(from, piece.size(), words);
      from += piece.size();
    }
  }
}

}  // namespace

std::vector<int32_t> addContents(const MapContents& contents, const MeshStates* states,
                                 BlockTable& table, MapBackend& backend) {
  const MapSize size = sizeOf(contents.blocks);
  const bool has_colours = size.bricks > 0 || contents.painted;
  backend.reserve({size.blocks, size.voxel_arrays, size.bricks, has_colours,
                   states == nullptr ? 0 : size.blocks});
  std::vector<BlockRequest> requests;
  std::vector<ColourRequest> colours;
  for (const MapBlock& block : contents.blocks) {
    requests.push_back({packKey(block.key), block.directions});
    if (block.bricks != 0) colours.push_back({packKey(block.key), block.bricks});
  }
  const Admission admission = table.admit(std::move(requests));
  const Admission painted = table.admitColours(std::move(colours));
  if (admission.refused > 0 || painted.refused > 0) {
    throw std::logic_error("map contents exceed the budget; the caller must make room first");
  }
  const std::vector<int32_t>& slots = admission.changed_slots;
  backend.follow({slots, false, &admission.new_arrays, &painted.bricks});
  backend.copyIn(orderOf(table, slots), contents, states);
  return slots;
}

/// Writes blocks and releases them. Blocks that cannot be written are unchanged.
/// @return whether all were written.
bool Pager::writeBatch(MapBackend& backend, const std::vector<int32_t>& slots) {
  backend.reserve({0, 0, 0, false, slots.size()});
  const auto batch = std::make_shared<std::pair<MapContents, MeshStates>>();
  auto& [contents, states] = *batch;
  contents.blocks = mapBlocks(table_, slots);
  allocateWords(contents);
  backend.copyOut(orderOf(table_, slots), contents, &states);
  Words words(contents, &states);
  std::vector<int32_t> released;
  released.reserve(slots.size());
  for (size_t i = 0; i < slots.size(); ++i) {
    const PagedBlock block{contents.blocks[i], table_.block(slots[i]).extractions,
                           states.states[i]};
    if (!blocks_.put(block, words.next(block.block, block.mesh.has_labels, batch))) break;
    released.push_back(slots[i]);
  }
  const bool are_all_written = released.size() == slots.size();
  if (!are_all_written) backend.copyIn({{}, {}, slots}, MapContents(), &states);
  for (const int32_t slot : released) table_.release(slot, kAllDirections);
  backend.follow({released});
  written_ += released.size();
  return are_all_written;
}

/// Loads blocks into memory, and drops damaged blocks from the map. @pre There is room for the
/// blocks. @return the number of blocks that stay on disk because they cannot be read now.
size_t Pager::readBatch(MapBackend& backend, std::vector<int32_t> numbers) {
  const auto start = std::chrono::steady_clock::now();
  std::sort(numbers.begin(), numbers.end(),
            [this](int32_t a, int32_t b) { return blocks_.keyOf(a) < blocks_.keyOf(b); });
  MapContents contents;
  MeshStates states;
  size_t labelled = 0;
  for (const int32_t number : numbers) {
    const PagedBlock& block = blocks_.block(number);
    contents.blocks.push_back(block.block);
    states.states.push_back(block.mesh);
    labelled += block.mesh.has_labels ? 1 : 0;
  }
  allocateWords(contents);
  states.labels = PlainArray<UnitLabels>(labelled * kVoxelsPerBlock);
  Words words(contents, &states);
  std::vector<RecordBytes> places;
  for (size_t i = 0; i < numbers.size(); ++i) {
    places.push_back(words.next(contents.blocks[i], states.states[i].has_labels));
  }
  std::vector<Reading> readings(numbers.size());
  parallelFor<std::vector<char>, kReadAtOnce>(numbers.size(), threads_,
                                              [&](size_t i, std::vector<char>& record) {
                                                readings[i] = blocks_.read(numbers[i], record);
                                                if (readings[i] == Reading::kIntact)
                                                  fill(places[i], record.data());
                                              });
  blocks_.store().noteWait(start);
  std::vector<int32_t> read;
  std::vector<PackedKey> damaged;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (readings[i] == Reading::kIntact) read.push_back(numbers[i]);
    if (readings[i] == Reading::kDamaged) damaged.push_back(blocks_.keyOf(numbers[i]));
  }
  if (read.size() < numbers.size()) {
    const size_t left = numbers.size() - read.size() - damaged.size();
    drop(backend, damaged);
    return left + (read.empty() ? 0 : readBatch(backend, std::move(read)));
  }
  const std::vector<int32_t> slots = addContents(contents, &states, table_, backend);
  for (size_t i = 0; i < slots.size(); ++i) {
    table_.setExtractions(slots[i], blocks_.block(numbers[i]).extractions);
    touch(slots[i]);
    blocks_.erase(numbers[i]);
  }
  read_ += slots.size();
  return 0;
}

void Pager::drop(MapBackend& backend, const std::vector<PackedKey>& keys) {
  if (keys.empty()) return;
  for (const int32_t number : numbersOf(keys)) blocks_.erase(number);
  dropped_.insert(dropped_.end(), keys.begin(), keys.end());
  no_writes_before_ = 0;  // the disk may have room now
  std::vector<MarkedKey> around;
  for (const PackedKey key : blocksAround(keys)) around.emplace_back(key, MeshMarks{true, false});
  setMarks(backend, around);
}

MeshUpdate Pager::takeDropped() {
  sortUnique(dropped_);
  MeshUpdate update;
  for (const PackedKey key : std::exchange(dropped_, {})) {
    update.blocks.emplace_back();
    update.blocks.back().key = unpackKey(key);
  }
  return update;
}

void Pager::markAll(const MeshMarks& marks) {
  for (const int32_t number : numbersOf(allPaged())) {
    const MeshState& mesh = blocks_.block(number).mesh;
    blocks_.setMarks(number, {mesh.marks.dirty || marks.dirty,
                              mesh.marks.painted || (marks.painted && mesh.has_mesh)});
  }
}

std::vector<PackedKey> Pager::allPaged() const {
  return blocks_.keysWhere([](const auto&) { return true; }, [](int32_t) { return true; });
}

std::vector<MarkedKey> Pager::marked(MapBackend& backend, bool taken) {
  std::vector<MarkedKey> all;
  for (const MarkedSlot& one : backend.marked(taken)) {
    all.emplace_back(packKey(table_.block(one.slot).key), one.marks);
  }
  if (!hasMarks()) return all;
  for (const int32_t number : numbersOf(allPaged())) {
    const MeshMarks marks = blocks_.block(number).mesh.marks;
    if (!marks.any()) continue;
    all.emplace_back(blocks_.keyOf(number), marks);
    if (taken) blocks_.setMarks(number, {});
  }
  return all;
}

void Pager::setMarks(MapBackend& backend, const std::vector<MarkedKey>& marked) {
  std::vector<MarkedSlot> slots;
  for (const auto& [key, marks] : marked) {
    const int32_t slot = table_.find(key), number = slot < 0 ? blocks_.find(key) : -1;
    if (slot >= 0) slots.push_back({slot, marks});
    if (number < 0) continue;
    const MeshMarks known = blocks_.block(number).mesh.marks;
    blocks_.setMarks(number, {known.dirty || marks.dirty, known.painted || marks.painted});
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

void Pager::copyWords(MapBackend& backend, MapContents& contents) {
  std::vector<int32_t> slots;
  for (const MapBlock& block : contents.blocks) {
    if (const int32_t slot = table_.find(packKey(block.key)); slot >= 0) slots.push_back(slot);
  }
  MapContents in_memory;
  in_memory.blocks = mapBlocks(table_, slots);
  allocateWords(in_memory);
  backend.copyOut(orderOf(table_, slots), in_memory);
  Words from(in_memory), words(contents);
  std::vector<PackedKey> lost;
  std::vector<char> record;
  for (const MapBlock& block : contents.blocks) {
    const PackedKey key = packKey(block.key);
    const int32_t slot = table_.find(key), number = slot < 0 ? blocks_.find(key) : -1;
    const RecordBytes to = words.next(block, false);
    if (slot >= 0 && directionsWithArrays(table_.block(slot)) != 0) {
      from.next(block, false).copyTo(record);
      fill(to, record.data());
      continue;
    }
    const auto reading = number < 0 ? Reading::kDamaged : blocks_.read(number, record);
    fill(to, reading == Reading::kIntact ? record.data() : nullptr);
    if (reading == Reading::kUnreadable) {
      throw std::runtime_error("the map cannot be copied: " + blocks_.store().stats().problem);
    }
    if (number >= 0 && reading == Reading::kDamaged) lost.push_back(key);
  }
  drop(backend, lost);
}

}  // namespace dtsdf
