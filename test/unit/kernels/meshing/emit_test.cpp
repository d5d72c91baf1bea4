#include "kernels/meshing/emit.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "kernels/meshing/edge_vertex.h"
#include "unit/kernels/meshing/cube_geometry.h"

namespace dtsdf {
namespace emit_test {

TEST(Emit, EdgesOfUnitsComeBack) {
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i unit = voxelOffset(i);
    for (int e = 0; e < kCubeEdges; ++e) {
      const auto [a, b] = cubeEdges()[static_cast<size_t>(e)];
      for (const int behind : {a, b}) {
        const int edge = unitEdge(unit, e, static_cast<uint8_t>(1 << behind));
        EXPECT_EQ(edgeFacing(edge), behind == a ? 0 : 1);
        EXPECT_EQ(edgeAxis(edge), e / 4);
        const Vec3f p = vertexPosition(edge, 0.25f);
        const Eigen::Vector3d expected = Eigen::Vector3d(unit.x, unit.y, unit.z) + cornerPoint(a) +
                                         0.25 * Eigen::Vector3d::Unit(e / 4);
        EXPECT_EQ(Eigen::Vector3d(p.x, p.y, p.z), expected);
      }
    }
  }
}

/// A level surface is two triangles on the unit's four upright edges, which face up: their lower
/// ends are behind.
TEST(Emit, ALevelUnitHasTwoTrianglesOnItsUprightEdges) {
  const Vec3i unit{2, 3, 4};
  std::vector<int> edges;
  visitTriangleEdges(kMeshTables, UnitIndices{{0x0F, 0}}, unit,
                     [&](int edge) { edges.push_back(edge); });
  ASSERT_EQ(edges.size(), 6u);
  std::set<int> corners;
  for (const int edge : edges) {
    EXPECT_EQ(edgeAxis(edge), 2);
    EXPECT_EQ(edgeFacing(edge), 0);
    corners.insert(edgeCorner(edge));
  }
  EXPECT_EQ(corners, (std::set<int>{cornerIndex(2, 3, 4), cornerIndex(3, 3, 4),
                                    cornerIndex(2, 4, 4), cornerIndex(3, 4, 4)}));
}

/// The first sheet's triangles come first.
TEST(Emit, BothSheetsAreVisitedInTurn) {
  std::vector<int> facings;
  visitTriangleEdges(kMeshTables, UnitIndices{{0x0F, 0xF0}}, {0, 0, 0},
                     [&](int edge) { facings.push_back(edgeFacing(edge)); });
  EXPECT_EQ(facings, (std::vector<int>{0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1}));
}

}  // namespace emit_test
}  // namespace dtsdf
