#include "tiles/make_tiles.h"

#include <algorithm>
#include <array>
#include <set>
#include <stdexcept>

namespace dtsdf {
namespace {

/// What a block that a frame touches costs in casting, folding and clearing, on one core; what an
/// image costs is measured by the plan itself. (redkitchen at 20 mm.)
constexpr double kBlockSeconds = 10e-6;
/// What a colour image costs, on one core. (redkitchen.)
constexpr double kImageSeconds = 20e-3;

/// Finds what a tile needs.
class TileMaker {
 public:
  explicit TileMaker(const TileSources& sources) : sources_(sources), ledger_(sources.ledger) {}

  /// A tile, and what it needs.
  Tile describe(const BlockExtent& own) const {
    Tile tile;
    tile.own = own;
    tile.fused = withHalo(own);
    tile.frames.resize(ledger_.recordings());
    tile.images.resize(ledger_.recordings());
    ledger_.visitPlaces(own, [&](const BlockExtent&, const PlaceInWork& in_work) {
      for (const BlockRequest& block : in_work.blocks) {
        tile.estimate.own_blocks += own.contains(unpackKey(block.key));
      }
    });
    if (tile.estimate.own_blocks > 0) addImages(tile);
    addFrames(tile);
    estimateSize(tile);
    tile.estimate.seconds += static_cast<double>(tile.frameCount()) * sources_.seconds_of_a_frame +
                             static_cast<double>(tile.imageCount()) * kImageSeconds;
    return tile;
  }

 private:
  void addImages(Tile& tile) const {
    const BlockExtent painted = withHalo(tile.own);
    for (const ImageInWork& image : sources_.colour_images) {
      if (!sources_.colour_reach.mayPaint(image.view, painted)) continue;
      tile.images[image.number.recording].add(image.number.index);
      tile.fused = around(tile.fused, sources_.colour_reach.blocksFor(image.view, painted));
    }
  }

  /// Frames of a place are those of its halo, too.
  void addFrames(Tile& tile) const {
    const BlockExtent inner{tile.fused.first + Vec3i{kHaloBefore, kHaloBefore, kHaloBefore},
                            tile.fused.last - Vec3i{kHaloBehind, kHaloBehind, kHaloBehind}};
    std::vector<const PlaceInWork*> fusing, passed;
    ledger_.visitPlaces(inner, [&](const BlockExtent& extent, const PlaceInWork& in_work) {
      fusing.push_back(&in_work);
      if (overlap(extent, tile.own)) passed.push_back(&in_work);
      tile.estimate.seconds += static_cast<double>(in_work.touched_blocks) * kBlockSeconds;
    });
    for (size_t recording = 0; recording < ledger_.recordings(); ++recording) {
      std::vector<const IndexRanges*> parts;
      const auto add = [&](const std::vector<IndexRanges>& frames) {
        if (recording < frames.size()) parts.push_back(&frames[recording]);
      };
      for (const PlaceInWork* place : fusing) add(place->frames);
      for (const PlaceInWork* place : passed) add(place->passing);
      tile.frames[recording] = IndexRanges::unite(parts);
    }
  }

  void estimateSize(Tile& tile) const {
    TileEstimate& estimate = tile.estimate;
    const BlockExtent painted = withHalo(tile.own);
    size_t painted_arrays = 0;
    ledger_.visitPlaces(tile.fused, [&](const BlockExtent& extent, const PlaceInWork& in_work) {
      if (!in_work.passing.empty()) estimate.free_bytes += freeBytesIn(tile.own, extent);
      for (const BlockRequest& block : in_work.blocks) {
        const BlockKey key = unpackKey(block.key);
        if (!tile.fused.contains(key)) continue;
        const auto arrays = static_cast<size_t>(__builtin_popcount(block.directions));
        ++estimate.blocks;
        estimate.voxel_arrays += arrays;
        if (tile.imageCount() > 0 && painted.contains(key)) painted_arrays += arrays;
      }
    });
    const size_t bytes = estimate.blocks * BlockTable::kBlockBytes +
                         estimate.voxel_arrays * BlockTable::kArrayBytes +
                         painted_arrays * kBricksPerArray * BlockTable::kColourBytes;
    estimate.map_bytes = bytes - bytesOnDisk(bytes);
  }

  /// Of a map, as far as memory does not hold it and the disk does.
  size_t bytesOnDisk(size_t map_bytes) const {
    const size_t budget = budgetOf(sources_.params).map_bytes;
    return std::min(map_bytes - std::min(map_bytes, budget), pageBytesOf(sources_.params.map));
  }

  /// Of the cubes of a tile that begin in an extent, at most.
  size_t freeBytesIn(const BlockExtent& own, const BlockExtent& extent) const {
    const BlockExtent cubes = cubesOf(inBoth(own, extent), sources_.params.space.cell_voxels);
    size_t count = 1;
    for (const int32_t edge : {cubes.last.x - cubes.first.x, cubes.last.y - cubes.first.y,
                               cubes.last.z - cubes.first.z}) {
      count *= static_cast<size_t>(std::max(edge + 1, 0));
    }
    return count * kFreeCubeBudgetBytes;
  }

  const TileSources& sources_;
  const FrameLedger& ledger_;
};

/// Two halves, across the longest edge.
std::array<BlockExtent, 2> halvesOf(const BlockExtent& extent) {
  const auto length = [](int32_t first, int32_t last) { return last - first; };
  const int32_t x = length(extent.first.x, extent.last.x);
  const int32_t y = length(extent.first.y, extent.last.y);
  const int32_t z = length(extent.first.z, extent.last.z);
  std::array<BlockExtent, 2> halves{extent, extent};
  int32_t BlockKey::*const axis =
      x >= y && x >= z ? &BlockKey::x : (y >= z ? &BlockKey::y : &BlockKey::z);
  const int32_t middle = extent.first.*axis + (extent.last.*axis - extent.first.*axis) / 2;
  halves[0].last.*axis = middle;
  halves[1].first.*axis = middle + 1;
  return halves;
}

bool isOneBlock(const BlockExtent& extent) {
  return extent.first.x == extent.last.x && extent.first.y == extent.last.y &&
         extent.first.z == extent.last.z;
}

}  // namespace

std::vector<Tile> makeTiles(const TileSources& sources) {
  const TileMaker maker(sources);
  std::set<Place> of_tiles;
  for (const auto& [place, in_work] : sources.ledger.places()) {
    if (in_work.blocks.empty() && in_work.passing.empty()) continue;
    visitGrid(sources.ledger.extentOf(place), sources.tile_blocks,
              [&](const Place& tile) { of_tiles.insert(tile); });
  }
  const MemoryBudget budget = budgetOf(sources.params);
  std::vector<Tile> tiles;
  for (const Place& place : of_tiles) {
    const std::vector<Tile> parts =
        cutToBudget(boxOfGrid(place, sources.tile_blocks), budget,
                    [&](const BlockExtent& own) { return maker.describe(own); });
    tiles.insert(tiles.end(), parts.begin(), parts.end());
  }
  return tiles;
}

std::vector<Tile> cutToBudget(const BlockExtent& own, const MemoryBudget& budget,
                              const std::function<Tile(const BlockExtent&)>& describe) {
  const Tile whole = describe(own);
  const TileEstimate& estimate = whole.estimate;
  if (estimate.own_blocks == 0 && estimate.free_bytes == 0) return {};
  if (estimate.map_bytes <= budget.map_bytes && estimate.free_bytes <= budget.free_bytes) {
    return {whole};
  }
  if (isOneBlock(own)) {
    throw std::runtime_error(
        "a single block and its neighbours take more than map/max_memory_mb; raise it, or lower "
        "colour/max_depth_m");
  }
  std::vector<Tile> parts;
  for (const BlockExtent& half : halvesOf(own)) {
    const std::vector<Tile> cut = cutToBudget(half, budget, describe);
    parts.insert(parts.end(), cut.begin(), cut.end());
  }
  return parts;
}

}  // namespace dtsdf
