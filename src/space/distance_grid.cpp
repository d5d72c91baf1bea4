#include "space/distance_grid.h"

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "map/region_view.h"
#include "space/sector_distances.h"

namespace dtsdf {
namespace {

template <class Visit>
void visitBetween(const Vec3i& low, const Vec3i& high, const Visit& visit) {
  for (int32_t z = low.z; z <= high.z; ++z) {
    for (int32_t y = low.y; y <= high.y; ++y) {
      for (int32_t x = low.x; x <= high.x; ++x) visit(Vec3i{x, y, z});
    }
  }
}

/// Marks cells as free if their centres lie in the region, which is given in cells.
void clear(const RegionView& region, const Vec3i& sector, CellSector& cells) {
  for (int number = 0; number < kCubesPerSector; ++number) {
    const Vec3i first = firstCellOfCube(cubeOfSector(sector, number));
    constexpr double kMiddle = 0.5 * kCubeSide, kReach = 6.1;  // to the outermost cell centres
    const Vec3d middle{first.x + kMiddle, first.y + kMiddle, first.z + kMiddle};
    if (!isInside(region, middle, kReach)) continue;
    CubeCells cube = cells.at(number);
    for (int i = 0; i < kCellsPerCube; ++i) {
      const int x = i % kCubeSide, y = i / kCubeSide % kCubeSide, z = i / (kCubeSide * kCubeSide);
      if (!isInside(region, Vec3d{first.x + x + 0.5, first.y + y + 0.5, first.z + z + 0.5}))
        continue;
      const uint64_t bit = uint64_t{1} << (x + kCubeSide * y);
      cube.surface.word[z] &= ~bit;
      cube.free.word[z] |= bit;
    }
    if (!isEmpty(cube)) cells.make(number) = cube;
  }
}

/// The cells in the axis-aligned box around `box`.
BlockExtent cellsAround(const BoxRegion& box, const SpaceSnapshot& space, int32_t reach) {
  const Eigen::Vector3d half_m = 0.5 * (box.T_W_B.linear().cwiseAbs() * box.size_m);
  const Eigen::Vector3d middle_m = box.T_W_B.translation();
  const double cell_m = space.cellSize_m();
  constexpr double kMaxCell = static_cast<double>(kMaxBlockCoordinate);  // leaves room for `reach`
  if (!((middle_m.cwiseAbs() + half_m).maxCoeff() < kMaxCell * cell_m)) {
    throw std::runtime_error("the box extends beyond the coordinates of a map");
  }
  // A flat box with few cells may still be within the maximum distance of many sectors.
  const Eigen::Array3d sectors =
      (2.0 * (half_m / cell_m).array() + 2.0 * reach) / kSectorSide + 2.0;
  constexpr double kMaxSectors = 4096.0;
  if ((2.0 * half_m / cell_m).prod() > static_cast<double>(kMaxGridPoints) ||
      sectors.prod() > kMaxSectors) {
    throw std::runtime_error("with cleared regions, the box may have at most " +
                             std::to_string(kMaxGridPoints) +
                             " cells of the map, fewer if it is flat; split it");
  }
  return {space.cellAt(middle_m - half_m), space.cellAt(middle_m + half_m)};
}

}  // namespace

PointGrid gridIn(const BoxRegion& box, double resolution_m) {
  if (!(resolution_m > 0.0) || !std::isfinite(resolution_m)) {
    throw std::runtime_error(
        "the resolution must be positive, in metres, or 0 for the size of the cells");
  }
  constexpr double kRounding = 1e-6;  // so that 0.3 m is three steps of 0.1 m
  const Eigen::Vector3d steps = (box.size_m / resolution_m).array() - kRounding;
  const Eigen::Vector3d points = steps.array().ceil().max(1.0);
  if (!(points.prod() <= static_cast<double>(kMaxGridPoints))) {
    throw std::runtime_error("the box has more than " + std::to_string(kMaxGridPoints) +
                             " points at this resolution; split it, or use a coarser resolution");
  }
  PointGrid grid{box.T_W_B, {}, resolution_m};
  for (int axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<uint32_t>(points[axis]);
  grid.T_W_G.translate(-0.5 * resolution_m * (points - Eigen::Vector3d::Ones()));
  return grid;
}

GridDistances distancesOn(const PointGrid& grid, const KnownSpace& space,
                          const Eigen::Matrix3d& R_F_W) {
  GridDistances result;
  result.distances_m.reserve(grid.count());
  result.gradients.reserve(3 * grid.count());
  for (size_t i = 0; i < grid.count(); ++i) {
    const size_t row = i / grid.size[0];
    const Eigen::Vector3d p(static_cast<double>(i % grid.size[0]),
                            static_cast<double>(row % grid.size[1]),
                            static_cast<double>(row / grid.size[1]));
    const SpaceDistance distance = space.distanceAt(grid.T_W_G * (p * grid.resolution_m));
    const Vec3f& g = distance.gradient;
    const Eigen::Vector3d gradient = R_F_W * Eigen::Vector3d(g.x, g.y, g.z);
    constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
    result.distances_m.push_back(distance.known ? distance.distance_m : kUnknown);
    for (int axis = 0; axis < 3; ++axis) {
      result.gradients.push_back(distance.known ? static_cast<float>(gradient[axis]) : kUnknown);
    }
  }
  return result;
}

SpaceSnapshot clearedIn(const BoxRegion& box, const std::vector<Region>& cleared,
                        const SpaceSnapshot& space) {
  const BlockExtent cells = cellsAround(box, space, space.reach_);
  std::vector<RegionView> regions;
  for (const Region& region : cleared)
    regions.push_back(makeRegionView(region, space.cell_size_m_));
  SpaceSnapshot result;
  result.cell_size_m_ = space.cell_size_m_;
  result.reach_ = space.reach_;
  const Vec3i reach{space.reach_ + 1, space.reach_ + 1, space.reach_ + 1}, next{1, 1, 1};
  visitBetween(sectorOfCell(cells.first - reach), sectorOfCell(cells.last + reach),
               [&](const Vec3i& key) {
                 const auto before = surfacesIn(space.cells_, packKey(key));
                 const auto sector = before == nullptr ? std::make_shared<CellSector>()
                                                       : std::make_shared<CellSector>(*before);
                 for (const RegionView& region : regions) clear(region, key, *sector);
                 result.cells_[packKey(key)] = Paged<CellSector>(sector, nullptr);
               });
  SectorDistances<int32_t> distances;
  visitBetween(sectorOfCell(cells.first - next), sectorOfCell(cells.last + next),
               [&](const Vec3i& key) {
                 const auto sector = std::make_shared<DistanceSector>();
                 sector->squared = distances.run(result.cells_, key, space.reach_);
                 if (sector->isEmpty()) return;
                 result.distances_[packKey(key)] = Paged<DistanceSector>(sector, nullptr);
               });
  return result;
}

}  // namespace dtsdf
