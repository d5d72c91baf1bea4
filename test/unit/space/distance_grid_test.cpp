#include "space/distance_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/error_of.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kCellOfGrid_m = 0.05, kReachOfGrid_m = 0.6;

/// Whether a cell's centre lies in the region, as the header defines it.
bool liesIn(const Region& region, const Vec3i& cell) {
  const Vector3d p = kCellOfGrid_m * (Vector3d(cell.x, cell.y, cell.z) + Vector3d::Constant(0.5));
  if (const auto* const ball = std::get_if<SphereRegion>(&region)) {
    return (p - ball->center_W).norm() <= ball->radius_m;
  }
  const auto& box = std::get<BoxRegion>(region);
  return ((box.T_W_B.inverse() * p).cwiseAbs() - 0.5 * box.size_m).maxCoeff() <= 0.0;
}

/// Random cells, most of them free. All cells in the `cleared` regions are free.
SpaceChanges randomCells(const std::vector<Region>& cleared) {
  std::mt19937 random(7);
  SpaceChanges changes{true, {}};
  for (int i = 0; i < 12 * 12 * 12; ++i) {
    SpaceCube cube{{8 * (i % 12 - 6), 8 * (i / 12 % 12 - 6), 8 * (i / 144 - 6)}, {}, {}};
    for (int32_t z = 0; z < SpaceCube::kSide; ++z) {
      for (int bit = 0; bit < 64; ++bit) {
        const uint32_t draw = random() % 1000;
        const Vec3i cell = cube.cellOf(z, bit);
        bool is_surface = draw < 3, is_free = draw >= 3 && draw < 800;
        for (const Region& region : cleared) {
          if (!liesIn(region, cell)) continue;
          is_surface = false;
          is_free = true;
        }
        cube.surface[static_cast<size_t>(z)] |= uint64_t{is_surface} << bit;
        cube.free[static_cast<size_t>(z)] |= uint64_t{is_free} << bit;
      }
    }
    changes.cubes.push_back(cube);
  }
  return changes;
}

std::shared_ptr<const SpaceSnapshot> spaceOf(const SpaceChanges& changes) {
  SpaceFollower follower(kReachOfGrid_m, 2);
  follower.apply(changes, kCellOfGrid_m);
  return follower.snapshot();
}

BoxRegion turnedBox(const Vector3d& middle, const Vector3d& size_m, double angle) {
  BoxRegion box{Eigen::Isometry3d(Eigen::Translation3d(middle)), size_m};
  box.T_W_B.rotate(Eigen::AngleAxisd(angle, Vector3d(1.0, 2.0, 3.0).normalized()));
  return box;
}

TEST(DistanceGrid, FillsABox) {
  const BoxRegion box = turnedBox({0.3, -0.2, 0.1}, {0.3, 0.25, 0.05}, 0.4);
  const PointGrid grid = gridIn(box, 0.1);
  EXPECT_EQ(grid.size, (std::array<uint32_t, 3>{3, 3, 1}));
  EXPECT_TRUE(grid.T_W_G.isApprox(box.T_W_B * Eigen::Translation3d(-0.1, -0.1, 0.0), 1e-12));
  const auto space = spaceOf(randomCells({}));
  const auto [distances_m, gradients] = distancesOn(grid, *space, Eigen::Matrix3d::Identity());
  ASSERT_EQ(distances_m.size(), 9u);
  const SpaceDistance one = space->distanceAt(grid.T_W_G * Vector3d(0.2, 0.1, 0.0));
  ASSERT_TRUE(one.known);
  EXPECT_EQ(distances_m[2 + 3 * 1], one.distance_m);
  EXPECT_EQ(gradients[3 * (2 + 3 * 1) + 1], one.gradient.y);
  size_t unknown = 0;
  for (const float distance : distances_m) unknown += std::isnan(distance);
  EXPECT_LT(unknown, 9u);
}

TEST(DistanceGrid, ClearedRegionsCountAsFree) {
  const std::vector<Region> cleared{turnedBox({0.2, 0.1, 0.0}, {0.5, 0.3, 0.7}, 0.7),
                                    SphereRegion{{-0.3, 0.2, 0.3}, 0.31},
                                    SphereRegion{{1.4, 0.1, 0.2}, 0.5}};
  const BoxRegion box = turnedBox({0.1, 0.2, -0.1}, {1.6, 1.5, 1.3}, 0.3);
  const PointGrid grid = gridIn(box, 0.03);
  const auto with = spaceOf(randomCells({})), without = spaceOf(randomCells(cleared));
  const auto bytesOn = [&](const KnownSpace& space) {
    const auto [distances_m, gradients] = distancesOn(grid, space, Eigen::Matrix3d::Identity());
    std::string bytes(reinterpret_cast<const char*>(distances_m.data()),
                      distances_m.size() * sizeof(float));
    return bytes.append(reinterpret_cast<const char*>(gradients.data()),
                        gradients.size() * sizeof(float));
  };
  EXPECT_TRUE(bytesOn(clearedIn(box, cleared, *with)) == bytesOn(*without));
  EXPECT_TRUE(bytesOn(clearedIn(box, {}, *with)) == bytesOn(*with));
  EXPECT_FALSE(bytesOn(*with) == bytesOn(*without));
}

TEST(DistanceGrid, IsRefusedIfTooLarge) {
  const auto space = spaceOf(randomCells({}));
  BoxRegion box{Eigen::Isometry3d::Identity(), {1.28, 1.28, 1.28}};
  EXPECT_EQ(gridIn(box, 0.01).count(), kMaxGridPoints);
  const auto errorAt = [&](double resolution_m) {
    return errorOf([&] { gridIn(box, resolution_m); });
  };
  EXPECT_NE(errorAt(0.00999).find("2097152 points"), std::string::npos);
  for (const double bad : {-1.0, 1e-300, std::nan(""), HUGE_VAL}) EXPECT_NE(errorAt(bad), "");
  box.size_m.setConstant(6.5);
  EXPECT_NE(errorOf([&] { clearedIn(box, {}, *space); }), "");
  box.size_m = {300.0, 300.0, 1e-3};
  EXPECT_NE(errorOf([&] { clearedIn(box, {}, *space); }), "");
  box.size_m.setConstant(1.0);
  box.T_W_B.translation().x() = 1e300;
  EXPECT_NE(errorOf([&] { clearedIn(box, {}, *space); }), "");
  const PointGrid grid = gridIn(box, 0.5);
  EXPECT_TRUE(std::isnan(distancesOn(grid, *space, Eigen::Matrix3d::Identity()).distances_m[0]));
}

}  // namespace
}  // namespace dtsdf
