// Tests the scene measurements on meshes with known areas and distances.
#include "scenes/surface.h"

#include <gtest/gtest.h>

#include "scenes/plane_raster.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// A unit square in the plane z = 0 that consists of two triangles.
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

TEST(Surface, OpenEdgesCountIfBothEndsAreInside) {
  const Mesh square = makeSquare();
  EXPECT_EQ(countOpenEdges(square, [](const Vector3d&) { return true; }), 4u);
  EXPECT_EQ(countOpenEdges(square, [](const Vector3d& p) { return p.x() > 0.5; }), 1u);
}

TEST(Surface, CoverageIsTheShareOfPointsWithinTheDistance) {
  const Surface square = surfaceOf(makeSquare());
  const Points row =
      pointsOnRectangle(Vector3d(1.0, 0.5, 0.05), {1.0, 0.0, 0.0}, {0.0, 1e-6, 0.0}, 0.01);
  EXPECT_NEAR(coveredPercent(row, square, 0.06), 51.5, 1.6);
  EXPECT_EQ(coveredPercent(row, square, 0.04), 0.0);
  EXPECT_EQ(coveredPercent(row, {}, 0.04), 0.0);
}

TEST(Surface, AreaAwayFromTheTruthExcludesNearSurfaces) {
  Scene scene;
  scene.add(Plane{Vector3d(0.0, 0.0, -0.1), Vector3d::UnitZ()});
  const Surface square = surfaceOf(makeSquare());
  EXPECT_NEAR(areaAwayFrom(scene, 0.09, square), 1.0, 1e-12);
  EXPECT_EQ(areaAwayFrom(scene, 0.11, square), 0.0);
}

TEST(Surface, ThinningKeepsOnePointPerCube) {
  const Points points = {{0.01, 0.01, 0.01}, {0.02, 0.02, 0.02}, {0.11, 0.01, 0.01}};
  EXPECT_EQ(thinOut(points, 0.1).size(), 2u);
}

PlaneRaster makeRaster() {
  return {{Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(1.5, 1.5)}, 0.01};
}

double coveredArea(const PlaneRaster& raster) {
  return raster.areaWhere([](const Eigen::Vector2d&, bool covered) { return covered; });
}

TEST(PlaneRaster, AreaIsAccurateForSidesAlongTheGrid) {
  for (const double side : {0.5, 0.5023, 0.5051, 0.5077}) {
    PlaneRaster raster = makeRaster();
    const Vector3d a(0.0013, 0.0037, 0.0), across(side, 0.0, 0.0), down(0.0, side, 0.0);
    raster.cover({{a, a + across, a + across + down}, {a + across + down, a, a + down}});
    EXPECT_NEAR(coveredArea(raster), side * side, 0.001 * side) << side;
  }
}

TEST(PlaneRaster, OverlappingTrianglesCountOnce) {
  PlaneRaster raster = makeRaster();
  const Surface square = surfaceOf(makeSquare());
  raster.cover(square);
  EXPECT_NEAR(coveredArea(raster), 1.0, 0.002);
  Surface behind = square;
  for (FlatTriangle& t : behind) {
    for (Vector3d* p : {&t.a, &t.b, &t.c}) *p += Vector3d(0.5, 0.0, 0.03);
  }
  raster.cover(behind);
  EXPECT_NEAR(coveredArea(raster), 1.5, 0.003);
}

TEST(PlaneRaster, TrianglesOutsideAreIgnored) {
  PlaneRaster raster = makeRaster();
  raster.cover({{Vector3d(-9.0, 0.0, 0.0), Vector3d(-8.0, 0.0, 0.0), Vector3d(-8.0, 1.0, 0.0)}});
  EXPECT_EQ(coveredArea(raster), 0.0);
  EXPECT_NEAR(raster.areaWhere(
                  [](const Eigen::Vector2d& p, bool covered) { return !covered && p.x() < 0.0; }),
              1.0, 0.002);
}

}  // namespace
}  // namespace dtsdf
