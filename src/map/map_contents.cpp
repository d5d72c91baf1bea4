#include "dtsdf_mapping/map_contents.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/map_parts.h"
#include "kernels/core/direction.h"
#include "kernels/core/voxel.h"
#include "map/block_table.h"
#include "map/memory_budget.h"
#include "params/printable.h"

namespace dtsdf {
namespace {

constexpr const char* kBoundSettings[] = {"map/voxel_size_m", "map/truncation_voxels",
                                          "map/directional", "fusion/mode"};
constexpr uint64_t kAllBricks = (uint64_t{1} << kDirectionCount * kBricksPerArray) - 1u;
constexpr uint64_t kBricksOfArray = (uint64_t{1} << kBricksPerArray) - 1u;

[[noreturn]] void refuse(const std::string& why) {
  throw std::runtime_error("the map's contents are invalid: " + why);
}

/// The bits of all bricks in the voxel arrays of these directions, as in MapBlock::bricks.
uint64_t bricksOf(uint32_t directions) {
  uint64_t bricks = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directions >> d & 1) bricks |= kBricksOfArray << (kBricksPerArray * d);
  }
  return bricks;
}

void checkFreeCubes(const MapContents& contents) {
  const int cell = contents.cell_voxels;
  if (cell != 0 && cell != 1 && cell != 2 && cell != 4 && cell != 8) {
    refuse("the cell size is invalid");
  }
  if (cell == 0 && !contents.free_cubes.empty()) refuse("it has free cells, but no cell size");
  const MapFreeCube* before = nullptr;
  for (const MapFreeCube& cube : contents.free_cubes) {
    if (!isRepresentable(cube.key)) refuse("a free cell is out of range");
    if (before != nullptr && packKey(before->key) >= packKey(cube.key)) {
      refuse("free cells are not sorted by key");
    }
    if (std::all_of(cube.cells.begin(), cube.cells.end(), [](uint64_t w) { return w == 0; })) {
      refuse("a cube contains no free cells");
    }
    before = &cube;
  }
}

int countBits(uint64_t bits) { return __builtin_popcountll(bits); }

/// Whether a mapper with these parameters would load the free cells.
bool takesOverFreeCells(const MapContents& contents, const MapperParams& params) {
  return params.space.enabled && contents.cell_voxels != 0;
}

bool isRigid(const Eigen::Isometry3d& T) {
  constexpr double kTolerance = 1e-6;
  const Eigen::Matrix3d& R = T.linear();
  return T.matrix().allFinite() &&
         (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance &&
         R.determinant() > 0.0;
}

/// Size of the part of the contents that a mapper with these parameters would load.
MapSize sizeTakenOver(const MapContents& contents, const MapperParams& params) {
  MapSize size = sizeOf(contents);
  if (!takesOverFreeCells(contents, params)) size.free_cubes = 0;
  return size;
}

bool isWithinBudget(const MapSize& size, const MapperParams& params) {
  const size_t free_bytes = size.free_cubes * kFreeCubeBudgetBytes;
  const size_t on_disk = pageBytesOf(params.map);
  return size.bytes() - free_bytes <= mapBudgetOf(params) + on_disk &&
         free_bytes <= freeBudgetOf(params) + on_disk;
}

}  // namespace

size_t MapSize::bytes() const {
  return blocks * BlockTable::kBlockBytes + voxel_arrays * BlockTable::kArrayBytes +
         bricks * BlockTable::kColourBytes + free_cubes * kFreeCubeBudgetBytes;
}

VoxelValues decodeVoxel(uint64_t word) {
  const Voxel voxel{static_cast<int16_t>(word & 0xffffu),
                    static_cast<uint16_t>(word >> 16 & 0xffffu), static_cast<uint32_t>(word >> 32)};
  return {sdfOf(voxel), weightOf(voxel), evidenceOf(voxel)};
}

MapSize sizeOf(const MapContents& contents) {
  MapSize size = sizeOf(contents.blocks);
  size.free_cubes = contents.free_cubes.size();
  return size;
}

MapSize sizeOf(const std::vector<MapBlock>& blocks) {
  MapSize size;
  size.blocks = blocks.size();
  const MapBlock* before = nullptr;
  for (const MapBlock& block : blocks) {
    if (!isRepresentable(block.key)) refuse("a block is out of range");
    if (before != nullptr && packKey(before->key) >= packKey(block.key)) {
      refuse("blocks are not sorted by key");
    }
    if (block.directions == 0 || (block.directions & ~kAllDirections) != 0) {
      refuse("a block has an invalid set of directions");
    }
    if ((block.bricks & kAllBricks & ~bricksOf(block.directions)) != 0 ||
        (block.bricks & ~kAllBricks) != 0) {
      refuse("a block has colours without voxels");
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
    refuse("the number of voxels does not match the blocks");
  }
  checkHead(contents);
}

void checkHead(const MapContents& contents) {
  const MapSize size = sizeOf(contents.blocks);
  if (contents.supporting_frames > contents.frames) refuse("the frame counts are inconsistent");
  if (!std::isfinite(contents.stamp_s)) refuse("the stamp of the newest frame is not finite");
  if (size.bricks > 0 && !contents.painted) refuse("it has colours, but was never painted");
  for (const float gain : contents.exposure) {
    if (!std::isfinite(gain) || gain < 0.001f || gain > 1000.0f) {
      refuse("the gains of the last colour image are out of range");
    }
  }
  if (contents.T_W_M && !isRigid(*contents.T_W_M)) refuse("its levelling transform is not rigid");
  checkFreeCubes(contents);
}

MapperParams withSettingsOf(const MapContents& contents, MapperParams params) {
  ParamTree tree = toTree(params);
  for (const char* key : kBoundSettings) {
    const auto found = contents.settings.find(key);
    if (found == contents.settings.end()) refuse(std::string("the setting ") + key + " is missing");
    tree[key] = found->second;
  }
  ParamReader reader(std::move(tree));
  visitParams(params, reader);
  checkParams(params, reader);  // some limits depend on the voxel size
  reader.finish();
  return params;
}

void checkFrame(const MapContents& contents, const std::string& map_frame) {
  if (contents.map_frame.empty() || map_frame.empty() || contents.map_frame == map_frame) return;
  throw std::runtime_error("the saved map is in frame '" + printable(contents.map_frame) +
                           "', but map_frame is '" + printable(map_frame) +
                           "'; start the node with the same map_frame");
}

void checkLevel(const MapContents& contents, bool is_levelled) {
  if (contents.frames == 0 || contents.T_W_M.has_value() == is_levelled) return;
  throw std::runtime_error(
      is_levelled ? "the saved map is not levelled, but map/level is floor or imu; set "
                    "map/level to none, or start a new map"
                  : "the saved map is levelled; set map/level to floor or imu (the saved levelling "
                    "transform is kept)");
}

size_t maxMapBytes(const MapperParams& params) {
  return (static_cast<size_t>(params.map.max_memory_mb) << 20) + pageBytesOf(params.map);
}

int minMemoryMb(const MapContents& contents, MapperParams params) {
  const MapSize size = sizeTakenOver(contents, params);
  params.map.max_memory_mb = static_cast<int>(size.bytes() >> 20) + 1;
  while (!isWithinBudget(size, params)) ++params.map.max_memory_mb;
  return params.map.max_memory_mb;
}

void checkFits(const MapContents& contents, const MapperParams& params, const std::string& remedy) {
  const ParamTree ours = toTree(params), theirs = toTree(withSettingsOf(contents, params));
  for (const char* key : kBoundSettings) {
    if (ours.at(key) == theirs.at(key)) continue;
    throw std::runtime_error("the saved map has " + std::string(key) + " " +
                             toString(theirs.at(key)) + ", not " + toString(ours.at(key)) +
                             (remedy.empty() ? "" : "; " + remedy));
  }
  if (takesOverFreeCells(contents, params) && contents.cell_voxels != params.space.cell_voxels) {
    throw std::runtime_error(
        "the saved map has free cells of " + std::to_string(contents.cell_voxels) +
        " voxels, but space/cell_voxels is " + std::to_string(params.space.cell_voxels) +
        "; change it, or switch space/enabled off to load the map without free cells");
  }
  if (!isWithinBudget(sizeTakenOver(contents, params), params)) {
    throw std::runtime_error("the saved map needs a map/max_memory_mb of at least " +
                             std::to_string(minMemoryMb(contents, params)) + ", but it is " +
                             std::to_string(params.map.max_memory_mb) + "; raise it");
  }
}

}  // namespace dtsdf
