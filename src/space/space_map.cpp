#include "space/space_map.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "kernels/space/see_free.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

/// Maximum number of cubes that restore() changes before it closes their sectors (see
/// cell_sector.h), to limit memory.
constexpr size_t kMaxAtOnce = size_t{1} << 16;

/// Approximate maximum number of cubes that takeChanges() returns: a few megabytes.
constexpr size_t kMaxChanges = size_t{1} << 15;

static_assert(2 * sizeof(CubeCells) <= kFreeCubeBudgetBytes,
              "the budget must count at least the memory that a cube takes");

bool acceptsAnySector(const Vec3i&) { return true; }

bool isKeyBefore(const Vec3i& a, const Vec3i& b) { return packKey(a) < packKey(b); }

bool contains(const CellMask& all, const CellMask& some) {
  return std::equal(all.word, all.word + kWordsPerCube, some.word,
                    [](uint64_t a, uint64_t b) { return (b & ~a) == 0; });
}

bool overlap(const CellMask& a, const CellMask& b) {
  return !std::equal(a.word, a.word + kWordsPerCube, b.word,
                     [](uint64_t x, uint64_t y) { return (x & y) == 0; });
}

/// The centre, in voxels, of a cell, cube or sector that is `side` voxels wide.
Vec3d middleOfBox(const Vec3i& key, int32_t side) {
  return {side * (key.x + 0.5), side * (key.y + 0.5), side * (key.z + 0.5)};
}

/// The distance from the centre of a cube or sector to its corners, in voxels.
double reachOf(int32_t side) { return 1.7321 * 0.5 * side; }  // square root of 3

/// Maximum extent of the view from the camera along each axis, as a multiple of the range. If the
/// diagonal field of view is 120 degrees, the corners of the view are at this distance.
constexpr float kMaxAside = 2.0f;

}  // namespace

int32_t cellLog2Of(const MapperParams& params) {
  return __builtin_ctz(static_cast<unsigned>(params.space.cell_voxels));
}

int reachInCells(const MapperParams& params) {
  return reachInCells(params.space.max_distance_m,
                      static_cast<double>(params.map.voxel_size_m) * params.space.cell_voxels);
}

SharedPagedValues makePages(const MapperParams& params, size_t max_bytes) {
  const MapParams& map = params.map;
  if (map.page_folder.empty()) return nullptr;
  return std::make_shared<PagedValues>(map.page_folder, pageBytesOf(map), max_bytes);
}

SpaceMap::SpaceMap(const MapperParams& params, int threads)
    : cell_log2_(cellLog2Of(params)),
      voxel_size_m_(params.map.voxel_size_m),
      max_range_m_(params.space.max_range_m),
      free_budget_(freeBudgetOf(params) + pageBytesOf(params.map)),
      pages_(makePages(params, freeBudgetOf(params))),
      table_(pages_),
      surfaces_(cell_log2_, threads, pages_),
      distances_(reachInCells(params), threads, pages_) {}

std::vector<Vec3i> SpaceMap::cubesInView(const FrameView& frame) const {
  const BlockExtent bounds = intersectionOf(boundsOfView(frame), extent_);
  const auto side = static_cast<float>(cubeSideInVoxels(cell_log2_));
  const float radius = 0.8661f * side;  // half the square root of 3
  const float range = max_range_m_ / frame.voxel_size_m;
  const float* const R = frame.T_L_C.R;
  const Vec3f ahead{R[2], R[5], R[8]};
  std::vector<Vec3i> keys;
  for (int32_t z = bounds.first.z; z <= bounds.last.z; ++z) {
    for (int32_t y = bounds.first.y; y <= bounds.last.y; ++y) {
      for (int32_t x = bounds.first.x; x <= bounds.last.x; ++x) {
        const Vec3i cube{x, y, z};
        const Vec3f middle =
            cornerOfCube(frame, cell_log2_, cube) + 0.5f * side * Vec3f{1.0f, 1.0f, 1.0f};
        if (dot(ahead, middle - frame.T_L_C.t) - radius > range) continue;
        if (mayBeInView(frame, middle, radius)) keys.push_back(cube);
      }
    }
  }
  return keys;
}

/// Bounds of the view frustum, limited by kMaxAside because a very wide view would be huge.
BlockExtent SpaceMap::boundsOfView(const FrameView& frame) const {
  const float range = max_range_m_ / frame.voxel_size_m;
  const Vec3f& eye = frame.T_L_C.t;
  Vec3f low = eye, high = eye;
  for (int corner = 0; corner < 4; ++corner) {
    const float u = corner % 2 == 0 ? -0.5f : static_cast<float>(frame.width) - 0.5f;
    const float v = corner / 2 == 0 ? -0.5f : static_cast<float>(frame.height) - 0.5f;
    const Vec3f p = transform(frame.T_L_C, backProject(frame.intrinsics, u, v, range));
    low = minOf(low, p);
    high = maxOf(high, p);
  }
  const float aside = kMaxAside * range;
  const auto cubeOf = [&](float x, float y, float z) {
    const Vec3i voxel = frame.origin_voxel + Vec3i{floorToInt(x), floorToInt(y), floorToInt(z)};
    const Vec3i cube = shiftDown(voxel, cell_log2_ + kCubeSideLog2);
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

void SpaceMap::addFree(const std::vector<CubeMask>& cubes) {
  const bool is_disk_full = pages_ != nullptr && pages_->isFull();
  for (const CubeMask& seen : cubes) {
    const CellMask known = table_.find(seen.key).free;
    if (contains(known, seen.cells)) continue;
    if (isEmpty(known)) {
      if (is_disk_full || freeBytes() + kFreeCubeBudgetBytes > free_budget_) {
        ++refused_cubes_;
        continue;
      }
      ++free_cubes_;
    }
    CubeCells& cube = table_.at(seen.key);
    for (int i = 0; i < kWordsPerCube; ++i) cube.free.word[i] |= seen.cells.word[i];
  }
  table_.close();
}

/// Resets free cells of a cube to unknown, and removes the cube if it has no known cells left.
void SpaceMap::forgetFree(const Vec3i& key, const CubeCells& known, const CellMask& cells) {
  if (!overlap(known.free, cells)) return;
  CubeCells& cube = table_.at(key);
  for (int i = 0; i < kWordsPerCube; ++i) cube.free.word[i] &= ~cells.word[i];
  if (isEmpty(cube.free)) {
    --free_cubes_;
    table_.removeIfEmpty(key);
  }
  table_.close();
}

void SpaceMap::addSurfaces(const std::vector<BlockMesh>& blocks) {
  for (const Vec3i& cube : surfaces_.apply(blocks, table_)) distances_.noteChange(cube);
}

void SpaceMap::clearRegion(const RegionView& region) {
  const int32_t cell_side = cellSide(cell_log2_), cube_side = cubeSideInVoxels(cell_log2_),
                sector_side = cube_side * kCubesAlong;
  const auto may_reach = [&](const Vec3i& key, int32_t side) {
    return isInside(region, middleOfBox(key, side), reachOf(side));
  };
  const auto takes = [&](const Vec3i& sector) { return may_reach(sector, sector_side); };
  table_.visit(takes, [&](const Vec3i& key, const CubeCells& cells) {
    if (!may_reach(key, cube_side)) return;
    CellMask inside = {};
    for (int i = 0; i < kCellsPerCube; ++i) {
      const Vec3i cell = firstCellOfCube(key) + voxelOffset(i);
      if (isInside(region, middleOfBox(cell, cell_side))) add(inside, i);
    }
    forgetFree(key, cells, inside);
  });
}

void SpaceMap::dropBeyond(const RegionView& kept) {
  const int32_t cube_side = cubeSideInVoxels(cell_log2_), sector_side = cube_side * kCubesAlong;
  const auto squared = [&](const Vec3i& key, int32_t side) {
    const Vec3d d = fromCentre(kept, middleOfBox(key, side));
    return d.x * d.x + d.y * d.y + d.z * d.z;
  };
  const double reach = kept.radius + reachOf(cube_side);
  // The centre of a cube is no farther from its sector's centre than the sector's corners.
  const double within = std::max(0.0, reach - reachOf(sector_side));
  const auto takes = [&](const Vec3i& sector) {
    return squared(sector, sector_side) >= within * within;
  };
  table_.visit(takes, [&](const Vec3i& key, const CubeCells& cells) {
    if (squared(key, cube_side) > reach * reach) forgetFree(key, cells, kAllCells);
  });
}

void SpaceMap::clear() {
  table_.clear();
  surfaces_.clear();
  distances_.clear();
  free_cubes_ = 0;
  refused_cubes_ = 0;
  if (pages_ != nullptr) pages_->resetCounts();
}

void SpaceMap::copyTo(MapContents& contents) const {
  contents.cell_voxels = cellSide(cell_log2_);
  contents.free_cubes.reserve(free_cubes_);
  table_.visit(acceptsAnySector, [&](const Vec3i& key, const CubeCells& cube) {
    if (isEmpty(cube.free)) return;
    MapFreeCube copy{key, {}};
    std::copy_n(cube.free.word, kWordsPerCube, copy.cells.begin());
    contents.free_cubes.push_back(copy);
  });
  if (contents.free_cubes.size() < free_cubes_ && !pages_->diskResponds()) {
    throw std::runtime_error("the map cannot be copied: " + pages_->stats().problem);
  }
  std::sort(contents.free_cubes.begin(), contents.free_cubes.end(),
            [](const MapFreeCube& a, const MapFreeCube& b) { return isKeyBefore(a.key, b.key); });
}

void SpaceMap::restore(const MapContents& contents) {
  size_t entered = 0;
  for (const MapFreeCube& cube : contents.free_cubes) {
    std::copy_n(cube.cells.begin(), kWordsPerCube, table_.at(cube.key).free.word);
    ++free_cubes_;
    if (++entered % kMaxAtOnce == 0) table_.close();
  }
  table_.close();
}

double SpaceMap::cellSize_m() const { return voxel_size_m_ * cellSide(cell_log2_); }

std::vector<SpaceCell> SpaceMap::cells() const {
  std::vector<Vec3i> keys;
  table_.visit(acceptsAnySector, [&](const Vec3i& key, const CubeCells&) { keys.push_back(key); });
  std::sort(keys.begin(), keys.end(), isKeyBefore);
  std::vector<SpaceCell> all;
  for (const Vec3i& key : keys) {
    const CubeCells cube = table_.find(key);
    for (int i = 0; i < kCellsPerCube; ++i) {
      const CellState state = stateIn(cube, i);
      if (state == CellState::kUnknown) continue;
      all.push_back({firstCellOfCube(key) + voxelOffset(i), state});
    }
  }
  return all;
}

SpaceChanges SpaceMap::takeChanges(bool all) { return table_.takeTouched(all, kMaxChanges); }

SpaceDistance SpaceMap::distanceAt(const Eigen::Vector3d& p_W) const {
  return interpolatedDistance(*this, distances_.sectors(), distances_.reach(), p_W);
}

size_t SpaceMap::freeBytes() const { return free_cubes_ * kFreeCubeBudgetBytes; }

size_t SpaceMap::bytes() const {
  return table_.bytes() + surfaces_.bytes() + distances_.bytes() +
         (pages_ == nullptr ? 0 : pages_->bytes());
}

void SpaceMap::addTo(PageStats& pages) const {
  if (pages_ == nullptr) return;
  const PagedValues::Stats stats = pages_->stats();
  pages.space_bytes = stats.bytes;
  pages.index_bytes += stats.index_bytes;
  pages.failures += stats.failures;
  pages.lost += stats.lost;
  pages.waits += stats.waits;
  pages.wait_ms += stats.wait_ms;
  if (!stats.problem.empty()) pages.problem = stats.problem;
}

}  // namespace dtsdf
