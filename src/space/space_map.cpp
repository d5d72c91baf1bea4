#include "space/space_map.h"

#include <algorithm>
#include <cmath>

#include "kernels/space/see_free.h"
#include "map/memory_budget.h"
#include "space/cell_units.h"
#include "space/distance_interpolation.h"

namespace dtsdf {
namespace {

/// Of a power of two.
int log2Of(int cell_voxels) {
  int log2 = 0;
  while (1 << log2 < cell_voxels) ++log2;
  return log2;
}

/// Times the range: an image of 120 degrees along its diagonal has its corners there.
constexpr float kMostAside = 2.0f;

Vec3d toDouble(int32_t factor, const Vec3i& a) {
  const auto times = static_cast<double>(factor);
  return {times * a.x, times * a.y, times * a.z};
}

CellState stateIn(const CellCube& cube, int cell) {
  if (isIn(cube.surface, cell)) return CellState::kSurface;
  return isIn(cube.free, cell) ? CellState::kFree : CellState::kUnknown;
}

static_assert(sizeof(CellCube) + sizeof(PackedKey) + 4 * 2 * sizeof(PackedKey) <=
                  kFreeCubeBudgetBytes,
              "what a cube counts is no less than what it takes");

static_assert(kCubeSideLog2 == SpaceCube::kSideLog2, "one layout of cells");

SpaceCube asSpaceCube(const CellCube& cube) {
  SpaceCube known{firstCellOfCube(cube.key), {}, {}};
  for (size_t z = 0; z < kWordsPerCube; ++z) {
    known.free[z] = cube.free.word[z] & ~cube.surface.word[z];
    known.surface[z] = cube.surface.word[z];
  }
  return known;
}

bool contains(const CellMask& all, const CellMask& some) {
  return std::equal(all.word, all.word + kWordsPerCube, some.word,
                    [](uint64_t a, uint64_t b) { return (b & ~a) == 0; });
}

bool overlap(const CellMask& a, const CellMask& b) {
  return !std::equal(a.word, a.word + kWordsPerCube, b.word,
                     [](uint64_t x, uint64_t y) { return (x & y) == 0; });
}

}  // namespace

CellGrid cellGridOf(const MapperParams& params) { return {log2Of(params.space.cell_voxels)}; }

int reachInCells(const MapperParams& params) {
  return reachInCells(params.space.max_distance_m,
                      static_cast<double>(params.map.voxel_size_m) * params.space.cell_voxels);
}

SpaceMap::SpaceMap(const MapperParams& params, int threads)
    : grid_(cellGridOf(params)),
      voxel_size_m_(params.map.voxel_size_m),
      max_range_m_(params.space.max_range_m),
      free_budget_(budgetOf(params).free_bytes),
      surfaces_(grid_, threads),
      distances_(reachInCells(params), threads) {}

std::vector<Vec3i> SpaceMap::cubesInView(const FrameView& frame) const {
  const BlockExtent bounds = inBoth(boundsOfView(frame), extent_);
  const auto side = static_cast<float>(cubeSideInVoxels(grid_));
  const float radius = 0.8661f * side;  // half the root of 3
  const float range = max_range_m_ / frame.voxel_size_m;
  const float* const R = frame.T_L_C.R;
  const Vec3f ahead{R[2], R[5], R[8]};
  std::vector<Vec3i> keys;
  for (int32_t z = bounds.first.z; z <= bounds.last.z; ++z) {
    for (int32_t y = bounds.first.y; y <= bounds.last.y; ++y) {
      for (int32_t x = bounds.first.x; x <= bounds.last.x; ++x) {
        const Vec3i cube{x, y, z};
        const Vec3f middle =
            lookAt(frame, grid_, cube).first_L + 0.5f * side * Vec3f{1.0f, 1.0f, 1.0f};
        if (dot(ahead, middle - frame.T_L_C.t) - radius > range) continue;
        if (mayBeInView(frame, middle, radius)) keys.push_back(cube);
      }
    }
  }
  return keys;
}

/// Bounds of the pyramid that the image looks into, cut off where an image looks so far aside that
/// it would go on for ever.
BlockExtent SpaceMap::boundsOfView(const FrameView& frame) const {
  const float range = max_range_m_ / frame.voxel_size_m;
  const Vec3f& eye = frame.T_L_C.t;
  Vec3f low = eye, high = eye;
  for (int corner = 0; corner < 4; ++corner) {
    const float u = corner % 2 == 0 ? -0.5f : static_cast<float>(frame.width) - 0.5f;
    const float v = corner / 2 == 0 ? -0.5f : static_cast<float>(frame.height) - 0.5f;
    const Vec3f p = transform(frame.T_L_C, backProject(frame.intrinsics, u, v, range));
    low = {minimum(low.x, p.x), minimum(low.y, p.y), minimum(low.z, p.z)};
    high = {maximum(high.x, p.x), maximum(high.y, p.y), maximum(high.z, p.z)};
  }
  const float aside = kMostAside * range;
  const auto cubeOf = [&](float x, float y, float z) {
    const Vec3i voxel = frame.origin_voxel + Vec3i{floorToInt(x), floorToInt(y), floorToInt(z)};
    const Vec3i cube = shiftDown(voxel, grid_.side_log2 + kCubeSideLog2);
    const auto within = [](int32_t at) {
      return std::clamp(at, -kMaxBlockCoordinate, kMaxBlockCoordinate);
    };
    return Vec3i{within(cube.x), within(cube.y), within(cube.z)};
  };
  return {cubeOf(maximum(low.x, eye.x - aside), maximum(low.y, eye.y - aside),
                 maximum(low.z, eye.z - aside)),
          cubeOf(minimum(high.x, eye.x + aside), minimum(high.y, eye.y + aside),
                 minimum(high.z, eye.z + aside))};
}

void SpaceMap::addFree(const std::vector<FreeCube>& cubes) {
  for (const FreeCube& seen : cubes) {
    const CellCube* const known = table_.find(seen.key);
    if (known != nullptr && contains(known->free, seen.free)) continue;
    if (known == nullptr || isEmpty(known->free)) {
      if (freeBytes() + kFreeCubeBudgetBytes > free_budget_) {
        ++refused_cubes_;
        continue;
      }
      ++free_cubes_;
    }
    CellCube& cube = table_.at(seen.key);
    for (int i = 0; i < kWordsPerCube; ++i) cube.free.word[i] |= seen.free.word[i];
  }
}

/// Takes cells out of what is free; the cube goes if nothing is known of it then.
void SpaceMap::forgetFree(const Vec3i& key, const CellMask& cells) {
  const CellMask& known = table_.find(key)->free;
  if (!overlap(known, cells)) return;
  CellCube& cube = table_.at(key);
  for (int i = 0; i < kWordsPerCube; ++i) cube.free.word[i] &= ~cells.word[i];
  if (!isEmpty(cube.free)) return;
  --free_cubes_;
  table_.removeIfEmpty(key);
}

void SpaceMap::addSurfaces(const std::vector<BlockMesh>& blocks) {
  for (const Vec3i& cube : surfaces_.apply(blocks, table_)) changed_.insert(packKey(cube));
}

Vec3d SpaceMap::middleOf(const Vec3i& cell) const {
  const double side = cellSide(grid_);
  return {side * (cell.x + 0.5), side * (cell.y + 0.5), side * (cell.z + 0.5)};
}

void SpaceMap::clearRegion(const RegionView& region) {
  const double side = cellSide(grid_), half = 0.5 * side * kCubeSide;
  const double reach = 1.7321 * half;  // from a cube's middle to its corners: the root of 3
  table_.visitKeys([&](const Vec3i& key) {
    const Vec3d corner = toDouble(cubeSideInVoxels(grid_), key);
    if (!isInside(region, Vec3d{corner.x + half, corner.y + half, corner.z + half}, reach)) return;
    CellMask inside = {};
    for (int i = 0; i < kCellsPerCube; ++i) {
      if (isInside(region, middleOf(firstCellOfCube(key) + voxelOffset(i)))) add(inside, i);
    }
    forgetFree(key, inside);
  });
}

void SpaceMap::dropBeyond(const KeptBall& kept) {
  const int32_t side = cubeSideInVoxels(grid_);
  const double half = 0.5 * side, reach = kept.radius + 1.7321 * half;  // the root of 3
  constexpr uint64_t kAll = ~uint64_t{0};
  constexpr CellMask kAllCells = {{kAll, kAll, kAll, kAll, kAll, kAll, kAll, kAll}};
  table_.visitKeys([&](const Vec3i& key) {
    const Vec3d corner = toDouble(side, key);
    const double dx = corner.x + half - kept.center.x, dy = corner.y + half - kept.center.y,
                 dz = corner.z + half - kept.center.z;
    if (dx * dx + dy * dy + dz * dz > reach * reach) forgetFree(key, kAllCells);
  });
}

void SpaceMap::clear() {
  table_.clear();
  surfaces_.clear();
  distances_.clear();
  changed_.clear();
  free_cubes_ = 0;
  refused_cubes_ = 0;
}

void SpaceMap::copyTo(MapContents& contents) const {
  contents.cell_voxels = cellSide(grid_);
  contents.free_cubes.reserve(free_cubes_);
  for (const CellCube* const cube : table_.sorted()) {
    if (isEmpty(cube->free)) continue;
    MapFreeCube copy{cube->key, {}};
    std::copy_n(cube->free.word, kWordsPerCube, copy.cells.begin());
    contents.free_cubes.push_back(copy);
  }
}

void SpaceMap::restore(const MapContents& contents) {
  for (const MapFreeCube& cube : contents.free_cubes) {
    std::copy_n(cube.cells.begin(), kWordsPerCube, table_.at(cube.key).free.word);
  }
  free_cubes_ = contents.free_cubes.size();
}

double SpaceMap::cellSize_m() const { return voxel_size_m_ * cellSide(grid_); }

CellState SpaceMap::stateOf(const Vec3i& cell) const {
  bringUpToDate();
  return knownStateOf(cell);
}

CellState SpaceMap::knownStateOf(const Vec3i& cell) const {
  const CellCube* const cube = table_.find(cubeOfCell(cell));
  if (cube == nullptr) return CellState::kUnknown;
  return stateIn(*cube, indexInCube(cell));
}

std::vector<SpaceCell> SpaceMap::cells() const {
  bringUpToDate();
  std::vector<SpaceCell> all;
  for (const CellCube* const cube : table_.sorted()) {
    for (int i = 0; i < kCellsPerCube; ++i) {
      const CellState state = stateIn(*cube, i);
      if (state == CellState::kUnknown) continue;
      all.push_back({firstCellOfCube(cube->key) + voxelOffset(i), state});
    }
  }
  return all;
}

std::vector<SpaceCube> SpaceMap::cubes(int32_t first_z, int32_t last_z) const {
  bringUpToDate();
  const int32_t low = first_z >> kCubeSideLog2, high = last_z >> kCubeSideLog2;
  std::vector<SpaceCube> found;
  table_.forEach([&](const CellCube& cube) {
    if (cube.key.z >= low && cube.key.z <= high) found.push_back(asSpaceCube(cube));
  });
  return found;
}

SpaceChanges SpaceMap::takeChanges(bool all) {
  bringUpToDate();
  const TouchedCubes touched = table_.takeTouched(all);
  SpaceChanges changes;
  changes.begins_anew = touched.begins_anew;
  for (const CellCube* cube : touched.live) changes.cubes.push_back(asSpaceCube(*cube));
  for (const Vec3i& key : touched.gone) {
    if (table_.find(key) == nullptr) changes.cubes.push_back({firstCellOfCube(key), {}, {}});
  }
  return changes;
}

void SpaceMap::updateDistances() {
  std::vector<SurfaceCube> changed;
  changed.reserve(changed_.size());
  for (const PackedKey key : changed_) {
    const CellCube* const cube = table_.find(unpackKey(key));
    changed.push_back({unpackKey(key), cube == nullptr ? CellMask{} : cube->surface});
  }
  distances_.update(changed);
  changed_.clear();
}

SpaceDistance SpaceMap::distanceAt(const Eigen::Vector3d& p_W) const {
  bringUpToDate();
  const DistanceUnits units{cellSize_m(), distances_.reach()};
  const auto around = cellsAround(p_W, units);
  if (!around) return unknownDistance(units);
  int squared[8];
  for (int i = 0; i < 8; ++i) squared[i] = squaredDistance(around->cell(i));
  return interpolate(*around, squared, knownStateOf(cellAt(p_W)) != CellState::kUnknown, units);
}

size_t SpaceMap::freeBytes() const { return free_cubes_ * kFreeCubeBudgetBytes; }

size_t SpaceMap::bytes() const {
  constexpr size_t kChanged = sizeof(PackedKey) + 2 * sizeof(void*);
  return table_.bytes() + surfaces_.bytes() + distances_.bytes() + changed_.size() * kChanged;
}

}  // namespace dtsdf
