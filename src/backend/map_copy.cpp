#include "backend/map_copy.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "map/map_head.h"

namespace dtsdf {
namespace {

// The words of MapContents have the layout of a mapper's memory, so they are copied unchanged.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "maps are copied as little endian words");
static_assert(sizeof(Voxel) == sizeof(uint64_t) && sizeof(VoxelColour) == sizeof(uint32_t),
              "voxels and colours are one word each");

/// Settings that are not stored, as they concern the computer, its memory or the display.
constexpr const char* kUnstoredSettings[] = {
    "backend", "threads", "map/max_memory_mb", "map/page_folder", "map/page_max_gb", "mesh/colour"};

/// Section of the rule parameters for poses, which are not stored either.
constexpr const char* kPoseRulesSection = "rules/poses/";

void eraseSection(const std::string& section, ParamTree& tree) {
  auto key = tree.lower_bound(section);
  while (key != tree.end() && key->first.compare(0, section.size(), section) == 0) {
    key = tree.erase(key);
  }
}

}  // namespace

MapContents contentsOf(MapperParams params, Rules rules) {
  ParamWriter writer;
  visitParams(params, writer);
  visitRules(rules, writer);
  for (const char* key : kUnstoredSettings) writer.tree.erase(key);
  eraseSection(kPoseRulesSection, writer.tree);
  MapContents contents;
  contents.settings = std::move(writer.tree);
  return contents;
}

std::vector<MapBlock> mapBlocks(const BlockTable& table, const std::vector<int32_t>& slots) {
  std::vector<MapBlock> blocks;
  blocks.reserve(slots.size());
  for (const int32_t slot : slots) {
    const BlockEntry& entry = table.block(slot);
    MapBlock block{entry.key, directionsWithArrays(entry), 0};
    if (block.directions == 0) continue;
    visitBricks(table, entry, [&](int direction, int brick, int32_t) {
      block.bricks |= uint64_t{1} << (kBricksPerArray * direction + brick);
    });
    blocks.push_back(block);
  }
  return blocks;
}

ContentsOrder orderOf(const BlockTable& table, const std::vector<int32_t>& slots) {
  ContentsOrder order;
  order.slots = slots;
  for (const int32_t slot : slots) {
    const BlockEntry& entry = table.block(slot);
    for (const int32_t array : entry.array) {
      if (array != kNoArray) order.arrays.push_back(array);
    }
    visitBricks(table, entry, [&](int, int, int32_t number) { order.bricks.push_back(number); });
  }
  return order;
}

void allocateWords(MapContents& contents) {
  size_t voxels = 0, colours = 0;
  for (const MapBlock& block : contents.blocks) {
    voxels += voxelWordsOf(block);
    colours += colourWordsOf(block);
  }
  contents.voxels = PlainArray<uint64_t>(voxels);
  contents.colours = PlainArray<uint32_t>(colours);
}

}  // namespace dtsdf
