#include "engine/block_records.h"

#include <cstring>
#include <utility>

namespace dtsdf {
namespace {

constexpr size_t kLabelBytes = kVoxelsPerBlock * sizeof(UnitLabels);

void copyBytes(void* to, const void* from, size_t size) {
  if (size > 0) std::memcpy(to, from, size);
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
  struct Source {
    const char *voxels, *colours;
  };
  Source next{reinterpret_cast<const char*>(contents.voxels.data()),
              reinterpret_cast<const char*>(contents.colours.data())};
  std::vector<Source> sources;
  sources.reserve(blocks.size());
  size_t bytes = 0;
  for (const PagedBlock& block : blocks) {
    sources.push_back(next);
    next.voxels += voxelBytes(block);
    next.colours += colourBytes(block);
    bytes += recordBytes(block);
  }
  PageBytes records(bytes);
  forEachRecord(blocks, [&](size_t i, size_t begin) {
    char* to = records.data() + begin;
    const auto append = [&](const void* from, size_t size) {
      copyBytes(to, from, size);
      to += size;
    };
    append(sources[i].voxels, voxelBytes(blocks[i]));
    append(sources[i].colours, colourBytes(blocks[i]));
    append(states[i].labels.data(), blocks[i].has_labels ? kLabelBytes : 0);
  });
  return records;
}

std::vector<MeshState> readRecords(const std::vector<PagedBlock>& blocks, const PageBytes& records,
                                   MapContents& contents) {
  std::vector<MeshState> states;
  const char* from = records.data();
  auto* voxels = reinterpret_cast<char*>(contents.voxels.data());
  auto* colours = reinterpret_cast<char*>(contents.colours.data());
  const auto take = [&](void* to, size_t size) {
    copyBytes(to, from, size);
    from += size;
  };
  for (const PagedBlock& block : blocks) {
    take(voxels, voxelBytes(block));
    take(colours, colourBytes(block));
    voxels += voxelBytes(block);
    colours += colourBytes(block);
    MeshState state{{block.dirty, block.painted}, block.has_mesh, {}};
    if (block.has_labels) {
      state.labels.resize(kVoxelsPerBlock);
      take(state.labels.data(), kLabelBytes);
    }
    states.push_back(std::move(state));
  }
  return states;
}

}  // namespace dtsdf
