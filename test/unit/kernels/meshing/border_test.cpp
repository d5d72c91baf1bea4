// Vertices on the border of what was measured, with shifts worked out by hand.
#include "kernels/meshing/border.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <set>

namespace dtsdf {
namespace {

/// Samples of any corner and direction.
struct Corners {
  std::function<Sample(const Vec3i&, int)> at;
  Sample sample(const Vec3i& corner, int direction) const { return at(corner, direction); }
};

constexpr int kXPlus = 0, kZPlus = 4;
constexpr GridEdge kEdge{{4, 4, 4}, 2, 0};  // along z, the surface faces Z+
constexpr float kOffset = 0.4f;

/// The plane z = 4.4 + slope (x - 4), seen by Z+ alone with a weight that depends on x.
Corners planeOf(const std::function<float(int)>& weight_of_x, float slope = 0.0f) {
  return {[=](const Vec3i& c, int direction) -> Sample {
    if (direction != kZPlus) return {0.0f, 0.0f};
    const float surface = 4.4f + slope * static_cast<float>(c.x - 4);
    return {static_cast<float>(c.z) - surface, weight_of_x(c.x)};
  }};
}

int edgeOf(const GridEdge& edge) {
  return edgeNumber(cornerIndex(edge.corner.x, edge.corner.y, edge.corner.z), edge.axis,
                    edge.facing);
}

Vec3f held(const Corners& corners) {
  return heldToBorder(MeshRules(), corners, edgeOf(kEdge),
                      vertexPosition(edgeOf(kEdge), kOffset));
}

TEST(CubeRoot, IsThatOfTheStandard) {
  EXPECT_EQ(cubeRoot(0.0f), 0.0f);
  EXPECT_EQ(cubeRoot(-1.0f), 0.0f);
  for (const float a : {1e-20f, 1e-6f, 0.125f, 0.3f, 1.0f, 27.0f, 1e9f}) {
    EXPECT_NEAR(cubeRoot(a) / std::cbrt(a), 1.0f, 1e-6f) << a;
  }
}

/// A weight of 1/16 of the inner neighbour's: (2 / 16)^(1/3) = 1/2 of the cell was covered.
TEST(Border, MovesToWhereTheMeasurementsEnd) {
  const Corners ends_above = planeOf([](int x) { return x < 4 ? 16.0f : (x == 4 ? 1.0f : 0.0f); });
  const Vec3f to_lower = held(ends_above);
  EXPECT_NEAR(to_lower.x, 3.5f, 1e-3f);
  EXPECT_EQ(to_lower.y, 4.0f);
  EXPECT_NEAR(to_lower.z, 4.4f, 1e-5f);
  const Corners ends_below = planeOf([](int x) { return x > 4 ? 16.0f : (x == 4 ? 1.0f : 0.0f); });
  EXPECT_NEAR(held(ends_below).x, 4.5f, 1e-3f);
}

/// Along the surface, which falls by 0.3 to the neighbour at 0.1.
TEST(Border, StaysOnTheSurface) {
  const Vec3f p = held(planeOf([](int x) { return x < 4 ? 16.0f : (x == 4 ? 1.0f : 0.0f); }, 0.3f));
  EXPECT_NEAR(p.x, 3.5f, 1e-3f);
  EXPECT_NEAR(p.z, 4.4f - 0.5f * 0.3f, 1e-3f);
}

/// 15/16 of an edge at most, though a weight of a millionth says that 1/80 was covered.
TEST(Border, LeavesTrianglesAnArea) {
  const Vec3f p = held(planeOf([](int x) { return x < 4 ? 1.0f : (x == 4 ? 1e-6f : 0.0f); }));
  EXPECT_EQ(p.x, 4.0f - 15.0f / 16.0f);
}

/// Half of the neighbour's weight is what a covered cell leaves; and where there is more beyond,
/// it is no border.
TEST(Border, IsWhereTheWeightFallsBelowHalf) {
  const auto heldX = [](float own, float beyond) {
    return held(planeOf([=](int x) { return x < 4 ? 1.0f : (x == 4 ? own : beyond); })).x;
  };
  EXPECT_EQ(heldX(0.51f, 0.0f), 4.0f);
  EXPECT_LT(heldX(0.4f, 0.0f), 4.0f);
  EXPECT_LT(heldX(0.01f, 0.009f), 4.0f);
  EXPECT_EQ(heldX(0.01f, 0.02f), 4.0f);
}

/// The plane rises by 3 a voxel, so that it misses the edge beside and crosses the one between the
/// lower ends, 0.4 / 3 away: 15/16 of the way there is less than the half that is not covered.
TEST(Border, FollowsASteepSurface) {
  const auto weight = [](int x) { return x < 4 ? 16.0f : (x == 4 ? 1.0f : 0.0f); };
  const Vec3f p = held(planeOf(weight, 3.0f));
  EXPECT_NEAR(p.x, 4.0f - 0.125f, 1e-3f);
  EXPECT_NEAR(p.z, 4.4f - 3.0f * 0.125f, 1e-3f);
}

/// The same falling: it crosses the edge between the upper ends, 0.6 / 3 away.
TEST(Border, FollowsASteepSurfaceUpwards) {
  const auto weight = [](int x) { return x < 4 ? 16.0f : (x == 4 ? 1.0f : 0.0f); };
  const Vec3f p = held(planeOf(weight, -3.0f));
  EXPECT_NEAR(p.x, 4.0f - 0.1875f, 1e-3f);
  EXPECT_NEAR(p.z, 4.4f + 3.0f * 0.1875f, 1e-3f);
}

/// Beside the vertex nothing is behind the surface: there is nowhere to move to.
TEST(Border, NeedsASurfaceToMoveAlong) {
  const Corners corners{[](const Vec3i& c, int direction) -> Sample {
    if (direction != kZPlus) return {0.0f, 0.0f};
    return {c.x < 4 ? (c.z <= 4 ? -0.4f : -0.6f) : static_cast<float>(c.z) - 4.4f,
            c.x < 4 && c.z <= 4 ? 16.0f : (c.x == 4 ? 1.0f : 0.0f)};
  }};
  EXPECT_EQ(held(corners).x, 4.0f);
}

/// The direction decides that tells the crossing, though the one that the surface faces ends.
TEST(Border, IsThatOfTheDirectionThatTellsTheCrossing) {
  const auto weightOf = [](int telling, const Sample& lower, const Sample& upper) {
    EdgeSamples samples = {};
    samples.lower[telling] = lower;
    samples.upper[telling] = upper;
    samples.lower[kZPlus] = {-0.4f, 1.0f};
    samples.upper[kZPlus] = {0.6f, 1.0f};
    return tellingDirection(samples, 2, 0);
  };
  EXPECT_EQ(weightOf(kXPlus, {-0.1f, 2.0f}, {0.1f, 2.0f}), kXPlus);
  EXPECT_EQ(weightOf(kXPlus, {-0.1f, 2.0f}, {0.1f, 0.4f}), kZPlus);      // 0.8 is less than 1
  EXPECT_EQ(weightOf(kXPlus, {0.1f, 2.0f}, {0.2f, 2.0f}), kZPlus);       // does not cross
  EXPECT_EQ(weightOf(kZPlus + 1, {-0.1f, 2.0f}, {0.1f, 2.0f}), kZPlus);  // faces against it
  EXPECT_EQ(tellingDirection(EdgeSamples{}, 2, 1), kZPlus + 1);
}

/// A corner of what was measured: both axes would move by a half, so each moves by a quarter.
TEST(Border, SharesTheWayBetweenTwoAxes) {
  const Corners corner{[](const Vec3i& c, int direction) -> Sample {
    if (direction != kZPlus) return {0.0f, 0.0f};
    const float x = c.x < 4 ? 4.0f : (c.x == 4 ? 0.25f : 0.0f);
    const float y = c.y < 4 ? 4.0f : (c.y == 4 ? 0.25f : 0.0f);
    return {static_cast<float>(c.z) - 4.4f, x * y};
  }};
  EXPECT_NEAR(held(corner).x, 3.75f, 1e-3f);
  EXPECT_NEAR(held(corner).y, 3.75f, 1e-3f);
}

/// An edge that runs nearly along the surface: its own direction knows the surface on one side
/// only, but X+ knows it everywhere, so that it does not end there.
TEST(Border, IsNoneWhereAnotherDirectionGoesOn) {
  const Corners corners{[](const Vec3i& c, int direction) -> Sample {
    const float sdf = static_cast<float>(c.z) - 4.4f;
    if (direction == kXPlus) return {sdf, 1.0f};
    if (direction == kZPlus) return {sdf, c.x < 4 ? 0.01f : 0.0001f};
    return {0.0f, 0.0f};
  }};
  const Vec3f p = held(corners);
  EXPECT_EQ(p.x, 4.0f);
  EXPECT_EQ(p.y, 4.0f);
}

/// The direction that faces against the edge's surface has no say: it is another surface's.
TEST(Border, IgnoresTheBackOfSomethingThin) {
  const Corners corners{[](const Vec3i& c, int direction) -> Sample {
    if (direction == kZPlus + 1) return {4.1f - static_cast<float>(c.z), 16.0f};
    if (direction != kZPlus) return {0.0f, 0.0f};
    return {static_cast<float>(c.z) - 4.4f, c.x < 4 ? 16.0f : (c.x == 4 ? 1.0f : 0.0f)};
  }};
  EXPECT_NEAR(held(corners).x, 3.5f, 1e-3f);
}

/// Random samples; remembers in which blocks they were asked for.
struct RandomCorners {
  std::mt19937* random;
  std::set<int>* blocks;

  Sample sample(const Vec3i& corner, int) const {
    blocks->insert(blockAround(corner));
    const bool is_behind = (*random)() % 2 == 0;
    return {is_behind ? -0.5f : 0.5f, static_cast<float>(1u << (*random)() % 8)};
  }
};

/// A block's vertices have to be made again for the voxels of just those blocks that are read.
TEST(Border, ReadsTheBlocksThatItsVerticesAreSaidToDependOn) {
  std::mt19937 random(3);
  std::set<int> blocks;
  for (int edge = 0; edge < kGridEdges; ++edge) {
    const Vec3i lower = cornerAt(edgeCorner(edge));
    if (component(lower, edgeAxis(edge)) == kBlockSide) continue;  // it leaves the grid
    for (int round = 0; round < 8; ++round) {
      heldToBorder(MeshRules(), RandomCorners{&random, &blocks}, edge, vertexPosition(edge, 0.5f));
    }
  }
  for (int n = 0; n < kBlocksAround; ++n) {
    const Vec3i from_read = Vec3i{0, 0, 0} - aroundOffset(n);
    EXPECT_EQ(blocks.count(n) == 1, hasVerticesOn(from_read)) << n;
  }
}

}  // namespace
}  // namespace dtsdf
