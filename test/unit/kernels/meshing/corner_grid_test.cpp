#include "kernels/meshing/corner_grid.h"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {
namespace corner_grid_test {

std::tuple<int, int, int> asTuple(const Vec3i& v) { return {v.x, v.y, v.z}; }

Vec3i voxelIn(const Vec3i& block, int index) {
  return firstVoxelOfBlock(block) + voxelOffset(index);
}

TEST(CornerGrid, CornersComeBackFromTheirIndex) {
  for (int i = 0; i < kGridCorners; ++i) {
    const Vec3i corner = cornerAt(i);
    EXPECT_EQ(cornerIndex(corner.x, corner.y, corner.z), i);
  }
  EXPECT_EQ(cornerIndex(3, 4, 5), 3 + 9 * 4 + 81 * 5);
}

TEST(CornerGrid, CornerSourceIsTheVoxelAtTheCorner) {
  for (int i = 0; i < kGridCorners; ++i) {
    const CornerSource source = cornerSource(i);
    EXPECT_EQ(asTuple(voxelIn(cornerBlockOffset(source.block), source.voxel)),
              asTuple(cornerAt(i)));
  }
}

/// A voxel is a corner of units in exactly the blocks that unitReachOffset() leads to.
TEST(CornerGrid, UnitReachCoversEveryUnitOfAVoxel) {
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

TEST(CornerGrid, CornerStrideLeadsAlongTheAxis) {
  const int corner = cornerIndex(3, 4, 5);
  EXPECT_EQ(asTuple(cornerAt(corner + cornerStride(0))), std::make_tuple(4, 4, 5));
  EXPECT_EQ(asTuple(cornerAt(corner + cornerStride(1))), std::make_tuple(3, 5, 5));
  EXPECT_EQ(asTuple(cornerAt(corner + cornerStride(2))), std::make_tuple(3, 4, 6));
}

TEST(CornerGrid, EdgesComeBackFromTheirNumber) {
  for (const int corner : {0, 1, 200, kGridCorners - 1}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int facing = 0; facing < 2; ++facing) {
        const int edge = edgeNumber(corner, axis, facing);
        EXPECT_LT(edge, kGridEdges);
        EXPECT_EQ(edgeCorner(edge), corner);
        EXPECT_EQ(edgeAxis(edge), axis);
        EXPECT_EQ(edgeFacing(edge), facing);
      }
    }
  }
}

}  // namespace corner_grid_test
}  // namespace dtsdf
