#include "kernels/colour/vertex_colour.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace vertex_colour_test {

struct ColouredSample {
  Sample sample;
  VoxelColour colour;
};

/// Samples in all directions at both ends of an edge along x.
struct Ends {
  ColouredSample lower[kDirectionCount] = {}, upper[kDirectionCount] = {};

  VertexColour colour(int facing) const {
    return colourOf(meanOnEdge(
        directionsOnEdge(0, facing), facing,
        [&](int d, bool is_upper) { return (is_upper ? upper : lower)[d].colour; },
        [&](int d, bool is_upper) { return (is_upper ? upper : lower)[d].sample; }));
  }
};

const VoxelColour kRed{200, 0, 0, 90}, kBlue{0, 0, 200, 90}, kNone{0, 0, 0, 0};

TEST(VertexColour, IsInterpolatedBetweenTheEnds) {
  Ends ends;
  ends.lower[0] = {{-0.25f, 1.0f}, kRed};
  ends.upper[0] = {{0.75f, 1.0f}, kBlue};
  const VertexColour colour = ends.colour(0);
  EXPECT_EQ(colour.red, 150);
  EXPECT_EQ(colour.blue, 50);
  EXPECT_EQ(colour.painted, 255);
}

TEST(VertexColour, UsesThePaintedEnd) {
  Ends ends;
  ends.lower[0] = {{-0.001f, 1.0f}, kNone};
  ends.upper[0] = {{0.999f, 1.0f}, kBlue};
  EXPECT_EQ(ends.colour(0).blue, 200);
}

/// Both sides of a plate thinner than a voxel cross the same edge, facing opposite ways.
TEST(VertexColour, EachSideHasItsOwnColour) {
  Ends ends;
  ends.lower[0] = {{-0.5f, 1.0f}, kRed};
  ends.upper[0] = {{0.5f, 1.0f}, kRed};
  ends.lower[1] = {{0.3f, 1.0f}, kBlue};
  ends.upper[1] = {{-0.7f, 1.0f}, kBlue};
  EXPECT_EQ(ends.colour(0).red, 200);
  EXPECT_EQ(ends.colour(0).blue, 0);
  EXPECT_EQ(ends.colour(1).blue, 200);
  EXPECT_EQ(ends.colour(1).red, 0);
}

TEST(VertexColour, WithoutACrossingIgnoresOppositeDirections) {
  Ends ends;
  ends.lower[2] = {{0.5f, 1.0f}, kRed};
  ends.upper[2] = {{0.6f, 1.0f}, kRed};
  ends.lower[1] = {{0.5f, 5.0f}, kBlue};  // X-, while the surface faces X+
  EXPECT_EQ(ends.colour(0).red, 200);
  EXPECT_EQ(ends.colour(0).blue, 0);
}

TEST(VertexColour, IsZeroIfUnpainted) {
  const VertexColour colour = Ends().colour(0);
  EXPECT_EQ(colour.red, 0);
  EXPECT_EQ(colour.painted, 0);
}

}  // namespace vertex_colour_test
}  // namespace dtsdf
