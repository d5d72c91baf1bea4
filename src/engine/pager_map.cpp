// The pager and the map as a whole: contents that are in memory in part.
#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "engine/block_records.h"
#include "engine/pager.h"
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
    if (slot >= 0) slots.push_back(slot);
    if (slot < 0) numbers.push_back(store_.find(packKey(block.key)));
  }
  MapContents in_memory;
  in_memory.blocks = mapBlocks(table_, slots);
  makeRoomForWords(in_memory);
  backend.copyOut(orderOf(table_, slots), in_memory);
  std::vector<char> records;
  if (!numbers.empty()) readAll(numbers, records);

  makeRoomForWords(contents);
  WordPlaces from, to;
  const char* record = records.data();
  size_t next_on_disk = 0;
  for (const MapBlock& block : contents.blocks) {
    const size_t voxels = voxelWordsOf(block), colours = colourWordsOf(block);
    if (table_.find(packKey(block.key)) >= 0) {
      copyTo(in_memory.voxels.data() + from.voxels, voxels, contents.voxels, to.voxels);
      copyTo(in_memory.colours.data() + from.colours, colours, contents.colours, to.colours);
      from.pass(block);
    } else {
      copyTo(record, voxels, contents.voxels, to.voxels);
      copyTo(record + voxels * sizeof(uint64_t), colours, contents.colours, to.colours);
      record += recordBytes(store_.block(numbers[next_on_disk++]));
    }
    to.pass(block);
  }
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

/// @throws std::runtime_error where some are damaged or cannot be read.
void Pager::readAll(const std::vector<int32_t>& numbers, std::vector<char>& records) {
  const WaitTimer timer(stats_);
  const std::vector<uint8_t> readings = store_.read(numbers, records);
  if (std::count(readings.begin(), readings.end(), kPageIntact) ==
      static_cast<std::ptrdiff_t>(readings.size())) {
    return;
  }
  throw std::runtime_error("the map cannot be copied: " + store_.problem());
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
