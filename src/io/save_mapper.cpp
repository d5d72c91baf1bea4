#include "io/save_mapper.h"

#include <algorithm>

#include "io/map_chunks.h"

namespace dtsdf {
namespace {

void setOrigin(const MapOrigin& origin, MapContents& contents) {
  contents.map_frame = origin.map_frame;
  contents.T_W_M = origin.T_W_M;
  contents.stamp_s = origin.stamp_s;
}

/// The blocks of a chunk, with what they hold.
MapContents chunkOf(Mapper& mapper, const MapContents& outline, size_t chunk) {
  const auto at = [&](size_t chunks) {
    const size_t block = std::min(outline.blocks.size(), chunks * kBlocksPerMapChunk);
    return outline.blocks.begin() + static_cast<std::ptrdiff_t>(block);
  };
  return mapper.part(std::vector<MapBlock>(at(chunk), at(chunk + 1)));
}

SavedMap saveInChunks(Mapper& mapper, const MapContents& outline, const std::string& path) {
  MapContents part;
  MapWords words;
  words.voxels = [&](size_t chunk) {
    part = chunkOf(mapper, outline, chunk);
    return part.voxels.data();
  };
  words.colours = [&](size_t chunk) {
    part = chunkOf(mapper, outline, chunk);
    return part.colours.data();
  };
  return saveMapInChunks(outline, words, path, 1);
}

MapContents outlineWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents outline = mapper.outline();
  setOrigin(origin, outline);
  return outline;
}

}  // namespace

MapContents contentsWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents contents = mapper.contents();
  setOrigin(origin, contents);
  return contents;
}

SavedMap saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path) {
  if (mapper.stats().pages.blocks == 0) return saveMap(contentsWith(origin, mapper), path);
  for (;;) {  // once more without blocks that turn out to be damaged
    const uint64_t lost = mapper.stats().pages.lost;
    const SavedMap saved = saveInChunks(mapper, outlineWith(origin, mapper), path);
    if (mapper.stats().pages.lost == lost) return saved;
  }
}

SavedMap savePartOf(Mapper& mapper, const MapOrigin& origin,
                    const std::function<bool(const BlockKey&)>& is_in, const std::string& path) {
  MapContents outline = outlineWith(origin, mapper);
  auto& blocks = outline.blocks;
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(),
                              [&](const MapBlock& block) { return !is_in(block.key); }),
               blocks.end());
  return saveInChunks(mapper, outline, path);
}

}  // namespace dtsdf
