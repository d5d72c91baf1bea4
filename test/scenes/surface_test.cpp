// What measures the scenes, against meshes whose areas and distances are known.
#include "scenes/surface.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// A unit square in z = 0 of two triangles.
Mesh makeSquare() {
  Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(Surface, RefinedTrianglesHaveTheSameArea) {
  const Surface square = surfaceOf(makeSquare());
  const Surface fine = refine(square, 0.1);
  EXPECT_NEAR(areaOf(square), 1.0, 1e-12);
  EXPECT_NEAR(areaOf(fine), 1.0, 1e-12);
  EXPECT_GT(fine.size(), 200u);
  EXPECT_NEAR(areaOf(refine(square, 0.01), [](const Vector3d& p) { return p.x() < 0.3; }), 0.3,
              0.01);
}

TEST(Surface, OpenEdgesCountWhereBothEndsLieInTheRegion) {
  const Mesh square = makeSquare();
  EXPECT_EQ(countOpenEdges(square, [](const Vector3d&) { return true; }), 4u);
  EXPECT_EQ(countOpenEdges(square, [](const Vector3d& p) { return p.x() > 0.5; }), 1u);
}

TEST(Surface, CoverageIsTheShareOfPointsWithinTheDistance) {
  const Surface square = surfaceOf(makeSquare());
  const Points row = pointsOnRectangle(Vector3d(1.0, 0.5, 0.05), {1.0, 0.0, 0.0},
                                       {0.0, 1e-6, 0.0}, 0.01);
  EXPECT_NEAR(coveredPercent(row, square, 0.06), 51.5, 1.6);
  EXPECT_EQ(coveredPercent(row, square, 0.04), 0.0);
  EXPECT_EQ(coveredPercent(row, {}, 0.04), 0.0);
}

TEST(Surface, AreaAwayFromTheTruthLeavesOutWhatIsNear) {
  Scene scene;
  scene.add(Plane{Vector3d(0.0, 0.0, -0.1), Vector3d::UnitZ()});
  const Surface square = surfaceOf(makeSquare());
  EXPECT_NEAR(areaAwayFrom(scene, 0.09, square), 1.0, 1e-12);
  EXPECT_EQ(areaAwayFrom(scene, 0.11, square), 0.0);
}

TEST(Surface, OnePointIsLeftInEachCube) {
  const Points points = {{0.01, 0.01, 0.01}, {0.02, 0.02, 0.02}, {0.11, 0.01, 0.01}};
  EXPECT_EQ(thinOut(points, 0.1).size(), 2u);
}

}  // namespace
}  // namespace dtsdf
