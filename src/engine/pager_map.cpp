// The pager and the map as a whole: marks of all blocks, and contents that are in memory in part.
#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "engine/block_records.h"
#include "engine/pager.h"
#include "kernels/core/direction.h"
#include "map/map_head.h"

namespace dtsdf {
namespace {

/// Where a block's words are among those of contents.
struct WordPlaces {
  size_t voxels = 0, colours = 0;

  void pass(const MapBlock& block) {
    voxels += voxelWordsOf(block);
    colours += colourWordsOf(block);
  }
};

template <class Word>
void copyTo(const void* from, size_t words, PlainArray<Word>& to, size_t place) {
  if (words > 0) std::memcpy(to.data() + place, from, words * sizeof(Word));
}

constexpr size_t kBlocksAtOnce = 1024;

}  // namespace

std::vector<PackedKey> Pager::keysInCells(const std::unordered_set<PackedKey>& cells) const {
  std::vector<PackedKey> keys;
  for (const PackedKey cell_key : cells) {
    const BlockCells::Cell* const cell = store_.cellIndex().find(cell_key);
    if (cell == nullptr) continue;
    for (const int32_t number : cell->slots) keys.push_back(store_.block(number).key);
  }
  return keys;
}

void Pager::markAllDirty() {
  store_.visit([this](int32_t number, const PagedBlock& block) {
    store_.setMarks(number, true, block.painted);
  });
}

void Pager::keepColours() {
  store_.visit([this](int32_t number, const PagedBlock& block) {
    store_.setMarks(number, block.dirty, block.painted || block.has_mesh);
  });
}

/// Most of the time there are none, of however many blocks.
std::vector<PackedKey> Pager::markedKeys() const {
  std::vector<PackedKey> keys;
  if (store_.marked() == 0) return keys;
  keys.reserve(store_.marked());
  store_.visit([&](int32_t, const PagedBlock& block) {
    if (isMarked(block)) keys.push_back(block.key);
  });
  return keys;
}

MeshMarks Pager::takeMarks(PackedKey key) {
  const int32_t number = store_.find(key);
  const MeshMarks marks{store_.block(number).dirty, store_.block(number).painted};
  store_.setMarks(number, false, false);
  return marks;
}

void Pager::setMarks(MapBackend& backend, const std::vector<MarkedKey>& marked) {
  std::vector<int32_t> slots;
  std::vector<MeshMarks> marks;
  for (const MarkedKey& one : marked) {
    const int32_t slot = table_.find(one.key);
    const int32_t number = slot < 0 ? store_.find(one.key) : -1;
    if (slot >= 0) {
      slots.push_back(slot);
      marks.push_back(one.marks);
    } else if (number >= 0) {
      const PagedBlock& block = store_.block(number);
      store_.setMarks(number, block.dirty || one.marks.dirty, block.painted || one.marks.painted);
    }
  }
  backend.mover()->setMarks(slots, marks);
}

void Pager::addBlocksTo(MapContents& contents) const {
  for (const BlockCells::Cell& cell : store_.cells()) {
    for (const int32_t number : cell.slots) {
      contents.blocks.push_back(mapBlockOf(store_.block(number)));
    }
  }
  std::sort(contents.blocks.begin(), contents.blocks.end(),
            [](const auto& a, const auto& b) { return packKey(a.key) < packKey(b.key); });
}

void Pager::copyWords(MapBackend& backend, MapContents& contents) {
  std::vector<int32_t> slots, numbers;
  for (const MapBlock& block : contents.blocks) {
    const int32_t slot = table_.find(packKey(block.key));
    const int32_t number = slot < 0 ? store_.find(packKey(block.key)) : -1;
    if (slot >= 0) slots.push_back(slot);
    if (number >= 0) numbers.push_back(number);
  }
  MapContents in_memory;
  in_memory.blocks = mapBlocks(table_, slots);
  makeRoomForWords(in_memory);
  backend.copyOut(orderOf(table_, slots), in_memory);
  PageBytes records;
  const std::vector<int32_t> damaged = readAll(numbers, records);

  makeRoomForWords(contents);
  WordPlaces from, to;
  const char* record = records.data();
  for (const MapBlock& block : contents.blocks) {
    const size_t voxels = voxelWordsOf(block), colours = colourWordsOf(block);
    const int32_t number = store_.find(packKey(block.key));
    if (number >= 0) {
      copyTo(record, voxels, contents.voxels, to.voxels);
      copyTo(record + voxels * sizeof(uint64_t), colours, contents.colours, to.colours);
      record += recordBytes(store_.block(number));
    } else if (directionsInMemory(packKey(block.key)) != 0) {
      copyTo(in_memory.voxels.data() + from.voxels, voxels, contents.voxels, to.voxels);
      copyTo(in_memory.colours.data() + from.colours, colours, contents.colours, to.colours);
      from.pass(block);
    } else {  // turned out to be damaged since it was listed
      std::fill_n(contents.voxels.data() + to.voxels, voxels, uint64_t{0});
      std::fill_n(contents.colours.data() + to.colours, colours, uint32_t{0});
    }
    to.pass(block);
  }
  lose(backend, damaged);
}

void Pager::copyAll(MapBackend& backend, MapContents& contents) {
  WordPlaces to;
  for (size_t first = 0; first < contents.blocks.size(); first += kBlocksAtOnce) {
    const size_t end = std::min(contents.blocks.size(), first + kBlocksAtOnce);
    MapContents part;
    part.blocks.assign(contents.blocks.begin() + static_cast<std::ptrdiff_t>(first),
                       contents.blocks.begin() + static_cast<std::ptrdiff_t>(end));
    copyWords(backend, part);
    copyTo(part.voxels.data(), part.voxels.size(), contents.voxels, to.voxels);
    copyTo(part.colours.data(), part.colours.size(), contents.colours, to.colours);
    for (const MapBlock& block : part.blocks) to.pass(block);
  }
}

/// @return those that are damaged, which are all 0 in the records.
/// @throws std::runtime_error where some cannot be read now.
std::vector<int32_t> Pager::readAll(const std::vector<int32_t>& numbers, PageBytes& records) {
  if (numbers.empty()) return {};
  const std::vector<uint8_t> readings = store_.read(numbers, records);
  std::vector<int32_t> damaged;
  size_t at = 0;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (readings[i] == kPageUnreadable) {
      throw std::runtime_error("the map cannot be copied: " + store_.problem());
    }
    const size_t bytes = recordBytes(store_.block(numbers[i]));
    if (readings[i] == kPageDamaged) {
      std::memset(records.data() + at, 0, bytes);
      damaged.push_back(numbers[i]);
    }
    at += bytes;
  }
  return damaged;
}

/// Blocks that are damaged are no longer in the map.
void Pager::lose(MapBackend& backend, const std::vector<int32_t>& numbers) {
  if (numbers.empty()) return;
  std::vector<PackedKey> keys;
  keys.reserve(numbers.size());
  for (const int32_t number : numbers) keys.push_back(store_.block(number).key);
  stats_.lost += keys.size();
  const std::vector<int32_t> slots = drop(backend, keys);
  for (const int32_t slot : slots) table_.vacate(slot, kAllDirections);
  backend.mover()->setMarks(slots, std::vector<MeshMarks>(slots.size(), {true, false}));
}

void Pager::visitParts(const MapContents& contents,
                       const std::function<void(const MapContents&)>& visit) const {
  const size_t most_bytes = table_.budgetBytes() / 8;
  WordPlaces from;
  for (size_t first = 0; first < contents.blocks.size();) {
    MapContents part = headOf(contents);
    WordPlaces to;
    size_t bytes = 0;
    for (; first < contents.blocks.size() && bytes < most_bytes; ++first) {
      const MapBlock& block = contents.blocks[first];
      part.blocks.push_back(block);
      to.pass(block);
      bytes += BlockTable::kBlockBytes + voxelWordsOf(block) * sizeof(uint64_t);
    }
    part.voxels = PlainArray<uint64_t>(to.voxels);
    part.colours = PlainArray<uint32_t>(to.colours);
    copyTo(contents.voxels.data() + from.voxels, to.voxels, part.voxels, 0);
    copyTo(contents.colours.data() + from.colours, to.colours, part.colours, 0);
    from.voxels += to.voxels;
    from.colours += to.colours;
    visit(part);
  }
}

}  // namespace dtsdf
