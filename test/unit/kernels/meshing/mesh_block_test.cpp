#include "kernels/meshing/mesh_block.h"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

namespace dtsdf {
namespace {

std::tuple<int, int, int> asTuple(const Vec3i& v) { return {v.x, v.y, v.z}; }

Vec3i voxelIn(const Vec3i& block, int index) {
  return firstVoxelOfBlock(block) + voxelOffset(index);
}

TEST(MeshBlock, LatticeSourceIsTheVoxelAtTheCorner) {
  for (int i = 0; i < kLatticeCorners; ++i) {
    const LatticeSource source = latticeSource(i);
    EXPECT_EQ(asTuple(voxelIn(latticeBlockOffset(source.block), source.voxel)),
              asTuple(latticeCorner(i)));
  }
}

TEST(MeshBlock, UnitSourceIsTheUnitInTheBlockOrAcrossAFace) {
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    for (int face = -1; face < 6; ++face) {
      const Vec3i unit = face < 0 ? voxelOffset(i) : voxelOffset(i) + faceOffset(face);
      const UnitSource source = unitSource(unit);
      EXPECT_EQ(asTuple(voxelIn(regularisationOffset(source.block), source.unit)), asTuple(unit));
    }
  }
}

/// A voxel is a corner of units in exactly the blocks that unitReachOffset() leads to.
TEST(MeshBlock, UnitReachCoversEveryUnitOfAVoxel) {
  std::set<std::tuple<int, int, int>> reached, expected;
  for (int n = 0; n < kUnitReach; ++n) reached.insert(asTuple(unitReachOffset(n)));
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    for (int c = 0; c < kCubeCorners; ++c) {
      const Vec3i unit = voxelOffset(i) - Vec3i{c & 1, c >> 1 & 1, c >> 2 & 1};
      expected.insert(asTuple(blockOfVoxel(unit)));
    }
  }
  EXPECT_EQ(reached, expected);
}

TEST(MeshBlock, LatticeStrideLeadsAlongTheAxis) {
  const int corner = latticeIndex(3, 4, 5);
  EXPECT_EQ(asTuple(latticeCorner(corner + latticeStride(0))), std::make_tuple(4, 4, 5));
  EXPECT_EQ(asTuple(latticeCorner(corner + latticeStride(1))), std::make_tuple(3, 5, 5));
  EXPECT_EQ(asTuple(latticeCorner(corner + latticeStride(2))), std::make_tuple(3, 4, 6));
}

TEST(MeshBlock, EdgeLowerCornerEqualsTheTable) {
  for (int e = 0; e < kCubeEdges; ++e) EXPECT_EQ(edgeLowerCorner(e), kEdgeLowerCorner[e]);
}

TEST(MeshBlock, SettlingLeavesALevelSurfaceAlone) {
  const UnitIndices level{{0x0F, 0}};  // behind below, in front above
  const auto at = [&](const Vec3i& unit) { return unit.z == 2 ? level : UnitIndices{{0, 0}}; };
  EXPECT_EQ(settleUnit(at, {3, 3, 2}).sheet[0], level.sheet[0]);
  EXPECT_EQ(settleUnit(at, {3, 3, 3}).sheet[0], 0);
}

}  // namespace
}  // namespace dtsdf
