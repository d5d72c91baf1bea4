#include "engine/block_records.h"

#include <cstring>
#include <utility>

namespace dtsdf {
namespace {

constexpr size_t kLabelBytes = kVoxelsPerBlock * sizeof(UnitLabels);

void copyBytes(void* to, const void* from, size_t size) {
  if (size > 0) std::memcpy(to, from, size);
}

/// Bytes from the first words of contents to a block's.
struct WordPlace {
  size_t voxels = 0, colours = 0;
};

std::vector<WordPlace> wordPlaces(const std::vector<PagedBlock>& blocks) {
  WordPlace next;
  std::vector<WordPlace> places;
  places.reserve(blocks.size());
  for (const PagedBlock& block : blocks) {
    places.push_back(next);
    next.voxels += voxelBytes(block);
    next.colours += colourBytes(block);
  }
  return places;
}

}  // namespace

PagedBlock pagedBlockOf(const MapBlock& block, const MeshState& state, uint32_t extractions) {
  return {packKey(block.key),    block.bricks,
          extractions,           static_cast<uint8_t>(block.directions),
          !state.labels.empty(), state.marks.dirty,
          state.marks.painted,   state.has_mesh};
}

PageBytes recordsOf(const std::vector<PagedBlock>& blocks, const MapContents& contents,
                    const std::vector<MeshState>& states) {
  const std::vector<WordPlace> places = wordPlaces(blocks);
  const auto* voxels = reinterpret_cast<const char*>(contents.voxels.data());
  const auto* colours = reinterpret_cast<const char*>(contents.colours.data());
  size_t bytes = 0;
  for (const PagedBlock& block : blocks) bytes += recordBytes(block);
  PageBytes records(bytes);
  forEachRecord(blocks, [&](size_t i, size_t begin) {
    char* to = records.data() + begin;
    const auto append = [&](const void* from, size_t size) {
      copyBytes(to, from, size);
      to += size;
    };
    append(voxels + places[i].voxels, voxelBytes(blocks[i]));
    append(colours + places[i].colours, colourBytes(blocks[i]));
    append(states[i].labels.data(), blocks[i].has_labels ? kLabelBytes : 0);
  });
  return records;
}

std::vector<MeshState> readRecords(const std::vector<PagedBlock>& blocks, const PageBytes& records,
                                   MapContents& contents) {
  std::vector<MeshState> states(blocks.size());
  const std::vector<WordPlace> places = wordPlaces(blocks);
  auto* voxels = reinterpret_cast<char*>(contents.voxels.data());
  auto* colours = reinterpret_cast<char*>(contents.colours.data());
  forEachRecord(blocks, [&](size_t i, size_t begin) {
    const PagedBlock& block = blocks[i];
    const char* from = records.data() + begin;
    const auto take = [&](void* to, size_t size) {
      copyBytes(to, from, size);
      from += size;
    };
    take(voxels + places[i].voxels, voxelBytes(block));
    take(colours + places[i].colours, colourBytes(block));
    states[i] = {{block.dirty, block.painted}, block.has_mesh, {}};
    if (!block.has_labels) return;
    states[i].labels.resize(kVoxelsPerBlock);
    take(states[i].labels.data(), kLabelBytes);
  });
  return states;
}

}  // namespace dtsdf
