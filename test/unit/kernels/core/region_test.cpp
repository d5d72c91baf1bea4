#include "kernels/core/region.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "map/region_view.h"

namespace dtsdf {
namespace region_test {

using Eigen::Vector3d;

/// A random box and a random sphere near a point. The expected results are computed with Eigen.
struct RandomRegion {
  explicit RandomRegion(std::mt19937& random, const Vector3d& near) {
    const auto number = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const Vector3d at = near + Vector3d(number(-9, 9), number(-9, 9), number(-9, 9));
    box.T_W_B =
        Eigen::Translation3d(at) * Eigen::Quaterniond(Eigen::Vector4d(number(-1, 1), number(-1, 1),
                                                                      number(-1, 1), number(0.1, 1))
                                                          .normalized());
    box.size_m = {number(0.1, 30), number(0.1, 30), number(0.1, 30)};
    sphere = {at, number(0.1, 20)};
  }

  bool holds(bool as_box, const Vector3d& p) const {
    if (!as_box) return (p - sphere.center_W).norm() <= sphere.radius_m;
    const Eigen::AlignedBox3d aligned(-0.5 * box.size_m, 0.5 * box.size_m);
    return aligned.contains(box.T_W_B.inverse() * p);
  }

  RegionView view(bool as_box, double unit_m) const {
    return makeRegionView(as_box ? Region(box) : Region(sphere), unit_m);
  }

  BoxRegion box;
  SphereRegion sphere;
};

/// Tests regions near the origin and far from it, with 1 m voxels.
TEST(Region, ContainsExactlyThePointsInside) {
  std::mt19937 random(7);
  for (const Vector3d& near : {Vector3d(0, 0, 0), Vector3d(8e6, -7e6, 5e6)}) {
    int inside = 0, outside = 0;
    for (int n = 0; n < 100; ++n) {
      const RandomRegion region(random, near);
      for (const bool as_box : {true, false}) {
        const RegionView view = region.view(as_box, 1.0);
        for (int i = 0; i < 200; ++i) {
          std::uniform_int_distribution<int> offset(-20, 20);
          const Vec3i voxel{static_cast<int>(near.x()) + offset(random),
                            static_cast<int>(near.y()) + offset(random),
                            static_cast<int>(near.z()) + offset(random)};
          const bool expected = region.holds(as_box, Vector3d(voxel.x, voxel.y, voxel.z));
          ASSERT_EQ(isInside(view, voxel), expected);
          ++(expected ? inside : outside);
        }
      }
    }
    EXPECT_GT(inside, 1000);
    EXPECT_GT(outside, 1000);
  }
}

/// Blocks with a voxel inside the region are never skipped; most other blocks are.
TEST(Region, NoBlockInsideIsSkipped) {
  std::mt19937 random(8);
  int needless = 0, skipped = 0;
  for (int n = 0; n < 60; ++n) {
    const RandomRegion region(random, Vector3d::Zero());
    for (const bool as_box : {true, false}) {
      const RegionView view = region.view(as_box, 1.0);
      for (int b = 0; b < 343; ++b) {
        const BlockKey block{b % 7 - 3, b / 7 % 7 - 3, b / 49 - 3};
        bool any = false;
        for (int i = 0; i < kVoxelsPerBlock; ++i) {
          any = any || isInside(view, firstVoxelOfBlock(block) + voxelOffset(i));
        }
        if (any) {
          ASSERT_TRUE(mayBeInside(view, block));
        } else {
          ++(mayBeInside(view, block) ? needless : skipped);
        }
      }
    }
  }
  EXPECT_GT(skipped, 2 * needless);
}

TEST(Region, InvalidSizesAndPosesAreReported) {
  const double nan = std::nan("");
  BoxRegion good;
  good.size_m = {1.0, 2.0, 3.0};
  BoxRegion flat = good, far = good, scaled = good;
  flat.size_m.y() = -1.0;
  far.T_W_B.translation().z() = HUGE_VAL;
  scaled.T_W_B.linear() *= 2.0;
  for (const Region& region : {Region(good), Region(SphereRegion{{1, 2, 3}, 0.5})}) {
    EXPECT_EQ(findProblem(region), "");
  }
  for (const Region& region :
       {Region(flat), Region(far), Region(scaled), Region(SphereRegion{{1, 2, 3}, 0.0}),
        Region(SphereRegion{{1, 2, 3}, -1.0}), Region(SphereRegion{{1, nan, 3}, 1.0}),
        Region(SphereRegion{{1, 2, 3}, nan})}) {
    EXPECT_NE(findProblem(region), "") << region.index();
  }
}

}  // namespace region_test
}  // namespace dtsdf
