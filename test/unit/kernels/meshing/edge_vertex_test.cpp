#include "kernels/meshing/edge_vertex.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/edge_samples.h"
#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace edge_vertex_test {

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
      const float offset = edgeOffset(MeshRules(), edge, e / 4, plane.at(a) < 0.0f ? 0 : 1);
      EXPECT_NEAR(offset, expected, kVertexMargin + 1e-5);
      ++crossed;
    }
  }
  EXPECT_GT(crossed, 10000);
}

/// Distances that are quadratic along the edge, by hand: 0.25 t^2 + t - 0.5 at t = -1, 0, 1, 2 is
/// -1.25, -0.5, 0.75, 2.5, and 0 at sqrt(6) - 2 = 0.4495; a line between the two ends says 0.4.
TEST(EdgeVertex, IsExactWhereDistancesAreQuadratic) {
  const float exact = std::sqrt(6.0f) - 2.0f;
  for (const float sign : {1.0f, -1.0f}) {
    const int facing = sign > 0.0f ? 0 : 1;
    EdgeSamples edge = {};
    edge.lower[0] = {-0.5f * sign, 1.0f};
    edge.upper[0] = {0.75f * sign, 1.0f};
    EXPECT_NEAR(edgeOffset(MeshRules(), edge, 1, facing), 0.4f, 1e-6f);
    edge.below[0] = {-1.25f * sign, 1.0f};  // one second difference is enough
    EXPECT_NEAR(edgeOffset(MeshRules(), edge, 1, facing), exact, 1e-6f);
    edge.above[0] = {2.5f * sign, 1.0f};
    EXPECT_NEAR(edgeOffset(MeshRules(), edge, 1, facing), exact, 1e-6f);
    edge.below[0] = {9.0f, 0.0f};
    EXPECT_NEAR(edgeOffset(MeshRules(), edge, 1, facing), exact, 1e-6f);
  }
}

/// The distance is 0 at the lower end, and would be again beyond it, before it falls to -0.1: 0/0,
/// once. The mean with a direction that crosses in the middle is a quarter.
TEST(EdgeVertex, IsANumberWhereADirectionTouchesTheLowerEnd) {
  EdgeSamples edge = {};
  edge.below[5] = {-0.9f, 1.0f};
  edge.lower[5] = {0.0f, 1.0f};
  edge.upper[5] = {-0.1f, 1.0f};
  EXPECT_EQ(edgeOffset(MeshRules(), edge, 2, 1), kVertexMargin);
  edge.lower[0] = {0.3f, 1.0f};
  edge.upper[0] = {-0.3f, 1.0f};
  EXPECT_NEAR(edgeOffset(MeshRules(), edge, 2, 1), 0.25f, 1e-6f);
}

/// A ball of 4 voxels and a saddle z = x y / 5, whose distances are not quadratic: nearer than a
/// line.
TEST(EdgeVertex, IsNearerThanALineOnABallAndASaddle) {
  const auto distance_to_ball = [](const Vec3f& p) { return norm(p) - 4.0f; };
  const auto distance_to_saddle = [](const Vec3f& p) {  // to second order
    const Vec3f gradient{-0.2f * p.y, -0.2f * p.x, 1.0f};
    return (p.z - 0.2f * p.x * p.y) / norm(gradient);
  };
  std::mt19937 random(5);
  std::uniform_real_distribution<float> at(-4.0f, 4.0f);
  double of_line = 0.0, of_parabola = 0.0;
  int crossed = 0;
  const auto tryEdge = [&](const auto& distance, const Vec3f& corner, int axis) {
    const auto sampleAt = [&](float along) {
      Vec3f p = corner;
      (axis == 0 ? p.x : (axis == 1 ? p.y : p.z)) += along;
      return Sample{distance(p), 1.0f};
    };
    EdgeSamples edge = {};
    const int d = 2 * axis;
    edge.lower[d] = sampleAt(0.0f);
    edge.upper[d] = sampleAt(1.0f);
    if (!(edge.lower[d].sdf < 0.0f && edge.upper[d].sdf > 0.3f)) return;
    float low = 0.0f, high = 1.0f;  // the crossing by bisection
    for (int i = 0; i < 30; ++i) {
      const float middle = 0.5f * (low + high);
      (sampleAt(middle).sdf < 0.0f ? low : high) = middle;
    }
    const double line = edgeOffset(MeshRules(), edge, axis, 0) - low;
    edge.below[d] = sampleAt(-1.0f);
    edge.above[d] = sampleAt(2.0f);
    const double parabola = edgeOffset(MeshRules(), edge, axis, 0) - low;
    of_line += line * line;
    of_parabola += parabola * parabola;
    ++crossed;
  };
  for (int trial = 0; trial < 20000; ++trial) {
    const Vec3f corner{at(random), at(random), at(random)};
    tryEdge(distance_to_ball, corner, trial % 3);
    tryEdge(distance_to_saddle, corner, trial % 3);
  }
  EXPECT_GT(crossed, 1000);
  EXPECT_LT(std::sqrt(of_parabola), 0.25 * std::sqrt(of_line));
}

/// What bends more than a ball of two voxels is limited to that.
TEST(EdgeVertex, BendsNoMoreThanASmallBall) {
  const Sample none{0.0f, 0.0f}, low{-0.5f, 1.0f}, high{0.5f, 1.0f};
  EXPECT_EQ(bendOnEdge(none, low, high, none), 0.0f);
  EXPECT_NEAR(bendOnEdge({-1.4f, 1.0f}, low, high, none), 0.1f, 1e-6f);
  EXPECT_EQ(bendOnEdge({9.0f, 1.0f}, low, high, none), 0.5f);
  EXPECT_EQ(bendOnEdge(none, low, high, {-9.0f, 1.0f}), -0.5f);
}

/// A wall that an edge passes through: each side by its own facing.
TEST(EdgeVertex, TellsTheTwoSidesOfAWallApart) {
  EdgeSamples edge = {};
  edge.lower[0] = {-0.7f, 2.0f};  // x+ sees the side at 0.7
  edge.upper[0] = {0.3f, 2.0f};
  edge.lower[1] = {0.4f, 5.0f};  // x- sees the side at 0.4
  edge.upper[1] = {-0.6f, 5.0f};
  EXPECT_NEAR(edgeOffset(MeshRules(), edge, 0, 0), 0.7f, 1e-6f);
  EXPECT_NEAR(edgeOffset(MeshRules(), edge, 0, 1), 0.4f, 1e-6f);
}

TEST(EdgeVertex, KeepsOffTheCorners) {
  EdgeSamples edge = {};
  edge.lower[4] = {-1e-9f, 1.0f};
  edge.upper[4] = {1.0f, 1.0f};
  EXPECT_EQ(edgeOffset(MeshRules(), edge, 2, 0), kVertexMargin);
  edge.lower[4] = {-1.0f, 1.0f};
  edge.upper[4] = {0.0f, 1.0f};
  EXPECT_EQ(edgeOffset(MeshRules(), edge, 2, 0), 1.0f - kVertexMargin);
}

/// Z+ crosses at 0.5 and counts 1 * 9 = 9, X+ crosses at 0.2 and counts 3 * 2 = 6: in all
/// (4.5 + 1.2) / 15 = 0.38. By the sums of their weights, 10 and 5, it would be 0.4; by
/// the lesser ones, 1 and 2, 0.3; all alike 0.35.
TEST(EdgeVertex, CrossingsCountByTheProductOfTheirWeights) {
  EdgeSamples edge = {};
  edge.lower[4] = {-0.5f, 1.0f};
  edge.upper[4] = {0.5f, 9.0f};
  edge.lower[0] = {-0.2f, 3.0f};
  edge.upper[0] = {0.8f, 2.0f};
  EXPECT_NEAR(edgeOffset(MeshRules(), edge, 2, 0), 0.38f, 1e-6f);
}

/// Along z and facing up, all directions have a say but Z-; facing down, all but Z+.
TEST(EdgeVertex, TheDirectionThatFacesAgainstAnEdgeHasNoSay) {
  for (int d = 0; d < kDirectionCount; ++d) {
    EXPECT_EQ(speaksOnEdge(d, 2, 0), d != 5);
    EXPECT_EQ(speaksOnEdge(d, 2, 1), d != 4);
    EXPECT_EQ(speaksOnEdge(d, 0, 0), d != 1);
  }
  EdgeSamples edge = {};
  edge.lower[4] = {-0.25f, 1.0f};
  edge.upper[4] = {0.75f, 1.0f};
  edge.lower[5] = {-0.75f, 100.0f};
  edge.upper[5] = {0.25f, 100.0f};
  EXPECT_EQ(edgeOffset(MeshRules(), edge, 2, 0), 0.25f);
}

/// Signs, zeros, distances that touch a corner, and samples that are not known.
TEST(EdgeVertex, SidesOfTheEndsTellWhichDirectionsCross) {
  std::mt19937 random(23);
  const float distances[] = {-0.5f, -0.04f, -0.0f, 0.0f, 0.04f, 0.5f};
  int crossed = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    EdgeSamples edge = {};
    uint32_t lower = 0, upper = 0;
    for (int d = 0; d < kDirectionCount; ++d) {
      edge.lower[d] = {distances[random() % 6], random() % 4 == 0 ? 0.0f : 1.0f};
      edge.upper[d] = {distances[random() % 6], random() % 4 == 0 ? 0.0f : 1.0f};
      lower |= sidesOfSample(d, edge.lower[d].sdf, edge.lower[d].weight);
      upper |= sidesOfSample(d, edge.upper[d].sdf, edge.upper[d].weight);
    }
    const int axis = static_cast<int>(random() % 3), facing = static_cast<int>(random() % 2);
    const uint32_t crossing = crossingDirections(edge, axis, facing);
    EXPECT_EQ(crossingDirections(sidesOfCorner(lower), sidesOfCorner(upper), axis, facing),
              crossing);
    crossed += crossing != 0 ? 1 : 0;
  }
  EXPECT_GT(crossed, 1000);
}

/// A sample without weight, or one that free space took more from than it had, crosses nothing.
TEST(EdgeVertex, UnobservedEndsCrossNothing) {
  for (const float weight : {0.0f, -1.0f}) {
    EdgeSamples edge = {};
    edge.lower[4] = {-0.25f, 1.0f};
    edge.upper[4] = {0.75f, 1.0f};
    edge.lower[0] = {-0.75f, 100.0f};
    edge.upper[0] = {0.25f, weight};
    EXPECT_EQ(edgeOffset(MeshRules(), edge, 2, 0), 0.25f);
  }
}

/// X+ is behind at both ends, 0.6 and 0.2 deep: the vertex divides the edge as 0.6 / (0.6 + 0.2).
TEST(EdgeVertex, WithoutACrossingTheVoteDividesTheEdge) {
  EdgeSamples edge = {};
  edge.lower[0] = {-0.6f, 1.0f};
  edge.upper[0] = {-0.2f, 1.0f};
  EXPECT_NEAR(edgeOffset(MeshRules(), edge, 2, 0), 0.75f, 1e-6f);
  EXPECT_EQ(edgeOffset(MeshRules(), EdgeSamples{}, 2, 0), 0.5f);  // nothing is known at all
}

/// With a nearness of 0.2, by (weight / (0.2 + |sdf|))^2:
///   lower end: X+ -0.3 counts (1 / 0.5)^2 = 4, Y+ 0.8 counts (2 / 1)^2 = 4:
///              (-1.2 + 3.2) / 8 = 0.25
///   upper end: X+ -0.05 counts (1 / 0.25)^2 = 16, Y+ 0.8 counts 4:
///              (-0.8 + 3.2) / 20 = 0.12
/// so the vertex lies at 0.25 / 0.37.
TEST(EdgeVertex, WithoutACrossingAllDirectionsVote) {
  EdgeSamples edge = {};
  edge.lower[0] = {-0.3f, 1.0f};
  edge.upper[0] = {-0.05f, 1.0f};
  edge.lower[2] = edge.upper[2] = {0.8f, 2.0f};
  EXPECT_NEAR(edgeOffset(MeshRules(), edge, 2, 0), 0.25f / 0.37f, 1e-6f);
}

TEST(EdgeVertex, TheUndirectedArrayFacesAsTheEdgeDoes) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int facing = 0; facing < 2; ++facing) {
      EXPECT_EQ(directionAxis(facedDirection(axis, facing)), axis);
      EXPECT_EQ(directionSign(facedDirection(axis, facing)), facing == 0 ? 1.0f : -1.0f);
    }
  }
}

}  // namespace edge_vertex_test
}  // namespace dtsdf
