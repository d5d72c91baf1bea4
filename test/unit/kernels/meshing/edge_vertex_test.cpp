#include "kernels/meshing/edge_vertex.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace edge_vertex_test {

/// Samples used by edgeOffset(): at both ends of an edge and one step beyond each.
struct EdgeSamples {
  Sample lower[kDirectionCount], upper[kDirectionCount];
  Sample below[kDirectionCount], above[kDirectionCount];

  Sample beyond(int end, int d) const { return (end == 0 ? below : above)[d]; }
};

float offsetOn(const EdgeSamples& edge, int axis, int facing) {
  uint32_t crossing = 0;
  visitDirections(directionsOnEdge(axis, facing), [&](int d) {
    crossing |= (crosses(edge.lower[d], edge.upper[d], facing) ? 1u : 0u) << d;
  });
  return edgeOffset(MeshRules(), edge, crossing, axis, facing);
}

TEST(EdgeVertex, IsExactOnAPlane) {
  std::mt19937 random(21);
  int crossed = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const UnitPlane plane = randomPlane(random);
    UnitSamples samples = {};
    addPlane(samples, plane);
    for (int e = 0; e < kCubeEdges; ++e) {
      const auto [a, b] = cubeEdges()[static_cast<size_t>(e)];
      if ((plane.at(a) < 0.0f) == (plane.at(b) < 0.0f)) continue;
      EdgeSamples edge = {};
      for (int d = 0; d < kDirectionCount; ++d) {
        edge.lower[d] = samples.corner[d][a];
        edge.upper[d] = samples.corner[d][b];
      }
      const double expected = plane.at(a) / (double(plane.at(a)) - plane.at(b));
      const float offset = offsetOn(edge, e / 4, plane.at(a) < 0.0f ? 0 : 1);
      EXPECT_NEAR(offset, expected, kVertexMargin + 1e-5);
      ++crossed;
    }
  }
  EXPECT_GT(crossed, 10000);
}

/// The distance along the edge, 0.25 t^2 + t - 0.5, is -1.25, -0.5, 0.75 and 2.5 at t = -1, 0, 1
/// and 2, and 0 at sqrt(6) - 2 = 0.4495. Linear interpolation between the ends would give 0.4.
TEST(EdgeVertex, IsExactForQuadraticDistances) {
  const float exact = std::sqrt(6.0f) - 2.0f;
  for (const float sign : {1.0f, -1.0f}) {
    const int facing = sign > 0.0f ? 0 : 1;
    EdgeSamples edge = {};
    edge.lower[0] = {-0.5f * sign, 1.0f};
    edge.upper[0] = {0.75f * sign, 1.0f};
    EXPECT_NEAR(offsetOn(edge, 1, facing), 0.4f, 1e-6f);
    edge.below[0] = {-1.25f * sign, 1.0f};  // the second difference at one end is enough
    EXPECT_NEAR(offsetOn(edge, 1, facing), exact, 1e-6f);
    edge.above[0] = {2.5f * sign, 1.0f};
    EXPECT_NEAR(offsetOn(edge, 1, facing), exact, 1e-6f);
    edge.below[0] = {9.0f, 0.0f};
    EXPECT_NEAR(offsetOn(edge, 1, facing), exact, 1e-6f);
  }
}

/// The distance is 0 at the lower end, rises, and falls to -0.1 at the upper end. The distance
/// in a second direction is 0 in the middle of the edge, so the mean position is at a quarter.
TEST(EdgeVertex, IsFiniteIfTheLowerEndIsZero) {
  EdgeSamples edge = {};
  edge.below[5] = {-0.9f, 1.0f};
  edge.lower[5] = {0.0f, 1.0f};
  edge.upper[5] = {-0.1f, 1.0f};
  EXPECT_EQ(offsetOn(edge, 2, 1), kVertexMargin);
  edge.lower[0] = {0.3f, 1.0f};
  edge.upper[0] = {-0.3f, 1.0f};
  EXPECT_NEAR(offsetOn(edge, 2, 1), 0.25f, 1e-6f);
}

/// The edge passes through a wall, whose two sides face opposite ways.
TEST(EdgeVertex, SeparatesTheSidesOfAWall) {
  EdgeSamples edge = {};
  edge.lower[0] = {-0.7f, 2.0f};  // the side that faces X+ is at 0.7
  edge.upper[0] = {0.3f, 2.0f};
  edge.lower[1] = {0.4f, 5.0f};  // the side that faces X- is at 0.4
  edge.upper[1] = {-0.6f, 5.0f};
  EXPECT_NEAR(offsetOn(edge, 0, 0), 0.7f, 1e-6f);
  EXPECT_NEAR(offsetOn(edge, 0, 1), 0.4f, 1e-6f);
}

}  // namespace edge_vertex_test
}  // namespace dtsdf
