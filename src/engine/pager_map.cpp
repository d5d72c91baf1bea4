// The pager and the map as a whole: contents that are in memory in part.
#include <algorithm>
#include <cstring>
#include <stdexcept>

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
void copyWords(const void* from, size_t words, PlainArray<Word>& to, size_t place) {
  if (words > 0) std::memcpy(to.data() + place, from, words * sizeof(Word));
}

constexpr size_t kBlocksAtOnce = 1024;

}  // namespace

/// Blocks of both, by key. Those in memory are copied over, those on disk are read.
void Pager::addTo(MapContents& contents) {
  if (store_.isEmpty()) return;
  std::vector<int32_t> numbers;
  store_.visit([&](int32_t number, const PagedBlock&) { numbers.push_back(number); });
  std::sort(numbers.begin(), numbers.end(), [this](int32_t a, int32_t b) {
    return store_.block(a).key < store_.block(b).key;
  });
  std::vector<MapBlock> in_memory;
  in_memory.swap(contents.blocks);
  for (const int32_t number : numbers) contents.blocks.push_back(mapBlockOf(store_.block(number)));
  contents.blocks.insert(contents.blocks.end(), in_memory.begin(), in_memory.end());
  std::sort(contents.blocks.begin(), contents.blocks.end(), [](const auto& a, const auto& b) {
    return packKey(a.key) < packKey(b.key);
  });
  const PlainArray<uint64_t> voxels = std::move(contents.voxels);
  const PlainArray<uint32_t> colours = std::move(contents.colours);
  const MapSize size = sizeOf(contents.blocks);
  contents.voxels = PlainArray<uint64_t>(size.voxel_arrays * kVoxelsPerBlock);
  contents.colours = PlainArray<uint32_t>(size.bricks * kVoxelsPerBrick);

  WordPlaces from, to;
  size_t next_in_memory = 0, next_on_disk = 0, next_record = 0;
  std::vector<char> records;
  for (const MapBlock& block : contents.blocks) {
    const size_t voxel_words = voxelWordsOf(block), colour_words = colourWordsOf(block);
    if (next_in_memory < in_memory.size() &&
        packKey(in_memory[next_in_memory].key) == packKey(block.key)) {
      copyWords(voxels.data() + from.voxels, voxel_words, contents.voxels, to.voxels);
      copyWords(colours.data() + from.colours, colour_words, contents.colours, to.colours);
      from.pass(block);
      ++next_in_memory;
    } else {
      if (next_on_disk % kBlocksAtOnce == 0) {
        const size_t end = std::min(numbers.size(), next_on_disk + kBlocksAtOnce);
        readAll({numbers.begin() + static_cast<std::ptrdiff_t>(next_on_disk),
                 numbers.begin() + static_cast<std::ptrdiff_t>(end)}, records);
        next_record = 0;
      }
      const char* const record = records.data() + next_record;
      copyWords(record, voxel_words, contents.voxels, to.voxels);
      copyWords(record + voxel_words * sizeof(uint64_t), colour_words, contents.colours,
                to.colours);
      next_record += recordBytes(store_.block(numbers[next_on_disk++]));
    }
    to.pass(block);
  }
}

/// @throws std::runtime_error where some are damaged.
void Pager::readAll(const std::vector<int32_t>& numbers, std::vector<char>& records) {
  const WaitTimer timer(stats_);
  const std::vector<uint8_t> intact = store_.read(numbers, records);
  if (std::find(intact.begin(), intact.end(), 0) == intact.end()) return;
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
    copyWords(contents.voxels.data() + from.voxels, to.voxels, part.voxels, 0);
    copyWords(contents.colours.data() + from.colours, to.colours, part.colours, 0);
    from.voxels += to.voxels;
    from.colours += to.colours;
    visit(part);
  }
}

}  // namespace dtsdf
