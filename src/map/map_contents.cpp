#include "dtsdf_mapping/map_contents.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "kernels/core/direction.h"
#include "map/block_table.h"

namespace dtsdf {
namespace {

constexpr const char* kBoundSettings[] = {"map/voxel_size_m", "map/truncation_voxels",
                                          "map/directional", "fusion/mode"};
constexpr uint32_t kAllDirections = (1u << kDirectionCount) - 1u;
constexpr uint64_t kAllBricks = (uint64_t{1} << kDirectionCount * kBricksPerArray) - 1u;
constexpr uint64_t kBricksOfArray = (uint64_t{1} << kBricksPerArray) - 1u;

[[noreturn]] void refuse(const std::string& why) {
  throw std::runtime_error("these are no contents of a map: " + why);
}

/// The bricks that voxel arrays of these directions can have.
uint64_t bricksOf(uint32_t directions) {
  uint64_t bricks = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directions >> d & 1) bricks |= kBricksOfArray << (kBricksPerArray * d);
  }
  return bricks;
}

int countBits(uint64_t bits) { return __builtin_popcountll(bits); }

ParamTree treeOf(MapperParams params) {
  ParamWriter writer;
  visitParams(params, writer);
  return std::move(writer.tree);
}

}  // namespace

size_t MapSize::bytes() const {
  return blocks * BlockTable::kBlockBytes + voxel_arrays * BlockTable::kArrayBytes +
         bricks * BlockTable::kColourBytes;
}

MapSize sizeOf(const std::vector<MapBlock>& blocks) {
  MapSize size;
  size.blocks = blocks.size();
  const MapBlock* before = nullptr;
  for (const MapBlock& block : blocks) {
    if (!isRepresentable(block.key)) refuse("a block lies outside the coordinates of a map");
    if (before != nullptr && packKey(before->key) >= packKey(block.key)) {
      refuse("blocks are not in the order of their keys");
    }
    if (block.directions == 0 || (block.directions & ~kAllDirections) != 0) {
      refuse("a block has no directions, or more than there are");
    }
    if ((block.bricks & kAllBricks & ~bricksOf(block.directions)) != 0 ||
        (block.bricks & ~kAllBricks) != 0) {
      refuse("a block has colours where it has no voxels");
    }
    size.voxel_arrays += static_cast<size_t>(countBits(block.directions));
    size.bricks += static_cast<size_t>(countBits(block.bricks));
    before = &block;
  }
  return size;
}

void checkContents(const MapContents& contents) {
  const MapSize size = sizeOf(contents.blocks);
  if (contents.voxels.size() != size.voxel_arrays * kVoxelsPerBlock ||
      contents.colours.size() != size.bricks * kVoxelsPerBrick) {
    refuse("the blocks hold more or less than there is");
  }
  if (contents.supporting_frames > contents.frames) refuse("frames are counted wrong");
  if (!std::isfinite(contents.stamp_s)) refuse("the stamp of the newest frame is none");
  if (size.bricks > 0 && !contents.painted) refuse("there is colour, but nothing was painted");
  for (const float gain : contents.exposure) {
    if (!std::isfinite(gain) || gain < 0.001f || gain > 1000.0f) {
      refuse("the exposure of the last colour image is none");
    }
  }
}

MapperParams withSettingsOf(const MapContents& contents, MapperParams params) {
  ParamTree tree = treeOf(params);
  for (const char* key : kBoundSettings) {
    const auto found = contents.settings.find(key);
    if (found == contents.settings.end()) refuse(std::string("the setting ") + key + " is missing");
    tree[key] = found->second;
  }
  ParamReader reader(std::move(tree));
  visitParams(params, reader);
  reader.finish();
  return params;
}

void checkFrame(const MapContents& contents, const std::string& map_frame) {
  if (contents.map_frame.empty() || map_frame.empty() || contents.map_frame == map_frame) return;
  throw std::runtime_error("the map to be loaded is of the frame '" + contents.map_frame +
                           "', and map_frame is '" + map_frame +
                           "' here; poses of one mean nothing in the other");
}

void checkFits(const MapContents& contents, const MapperParams& params) {
  const ParamTree ours = treeOf(params), theirs = treeOf(withSettingsOf(contents, params));
  for (const char* key : kBoundSettings) {
    if (ours.at(key) == theirs.at(key)) continue;
    throw std::runtime_error("the map to be loaded has " + std::string(key) + " " +
                             toString(theirs.at(key)) + ", and " + toString(ours.at(key)) +
                             " is what it would have to have here; only an empty map takes the "
                             "settings of what is loaded");
  }
  const size_t bytes = sizeOf(contents.blocks).bytes();
  if (bytes > static_cast<size_t>(params.map.max_memory_mb) << 20) {
    throw std::runtime_error("the map to be loaded takes " + std::to_string((bytes >> 20) + 1) +
                             " MiB, but map/max_memory_mb is " +
                             std::to_string(params.map.max_memory_mb) + "; raise it");
  }
}

}  // namespace dtsdf
