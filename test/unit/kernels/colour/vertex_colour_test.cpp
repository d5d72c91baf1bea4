#include "kernels/colour/vertex_colour.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace vertex_colour_test {

/// What each direction has at the ends of an edge along x.
struct Ends {
  ColouredSample lower[kDirectionCount] = {}, upper[kDirectionCount] = {};

  VoxelColour colour(int d, bool is_upper) const { return (is_upper ? upper : lower)[d].colour; }
  Sample sample(int d, bool is_upper) const { return (is_upper ? upper : lower)[d].sample; }

  VertexColour colour(int facing) const {
    return colourOf(meanOnEdge(speakingOnEdge(0, facing), facing, *this));
  }
};

const VoxelColour kRed{200, 0, 0, 90}, kBlue{0, 0, 200, 90}, kNone{0, 0, 0, 0};

TEST(VertexColour, IsBetweenThoseOfTheEnds) {
  Ends ends;
  ends.lower[0] = {{-0.25f, 1.0f}, kRed};
  ends.upper[0] = {{0.75f, 1.0f}, kBlue};
  const VertexColour colour = ends.colour(0);
  EXPECT_EQ(colour.red, 150);
  EXPECT_EQ(colour.blue, 50);
  EXPECT_EQ(colour.painted, 255);
}

TEST(VertexColour, TakesTheEndThatIsPainted) {
  Ends ends;
  ends.lower[0] = {{-0.001f, 1.0f}, kNone};
  ends.upper[0] = {{0.999f, 1.0f}, kBlue};
  EXPECT_EQ(ends.colour(0).blue, 200);
}

/// The plate thinner than a voxel: both sides cross the same edge, each with its facing.
TEST(VertexColour, EachSideHasItsOwn) {
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

TEST(VertexColour, WhereNothingCrossesWhatMaySpeakTells) {
  Ends ends;
  ends.lower[2] = {{0.5f, 1.0f}, kRed};
  ends.upper[2] = {{0.6f, 1.0f}, kRed};
  ends.lower[1] = {{0.5f, 5.0f}, kBlue};  // faces against the edge
  EXPECT_EQ(ends.colour(0).red, 200);
  EXPECT_EQ(ends.colour(0).blue, 0);
}

TEST(VertexColour, UnpaintedIsAllZero) {
  const VertexColour colour = Ends().colour(0);
  EXPECT_EQ(colour.red, 0);
  EXPECT_EQ(colour.painted, 0);
}

/// One block whose direction +x has a surface between x = 3 and x = 4, painted at one voxel only.
class VertexColourAround : public testing::Test {
 protected:
  VertexColourAround() {
    for (int z = 0; z < kBlockSide; ++z) {
      for (int y = 0; y < kBlockSide; ++y) {
        for (int x = 0; x < kBlockSide; ++x) {
          voxels_[voxelIndex(x, y, z)] = makeVoxel(static_cast<float>(x) - 3.5f, 65536, 9);
        }
      }
    }
    corners_.voxels.array[0][0] = voxels_;
    corners_.voxels.least_evidence = 1;
    const int painted = voxelIndex(3, 3, 3);
    bricks_[brickOf(painted)][placeInBrick(painted)] = kRed;
    for (int i = 0; i < kBricksPerArray; ++i) corners_.setBrick(0, 0, i, bricks_[i]);
  }

  VertexColour at(int y, int z, int facing = 0) const {
    return edgeColour(corners_, edgeNumber(cornerIndex(3, y, z), 0, facing), true);
  }

  Voxel voxels_[kVoxelsPerBlock] = {};
  VoxelColour bricks_[kBricksPerArray][kVoxelsPerBrick] = {};
  ColouredCorners corners_ = {};
};

/// A block that is looked at after another one has fewer bricks.
TEST_F(VertexColourAround, WhereNoColoursAreKeptNoneAreFound) {
  const CornerSource beside_red = cornerSource(Vec3i{3, 3, 3});
  EXPECT_EQ(corners_.directionsAt(beside_red), 1u);
  corners_.setBrick(0, 4, brickOf(beside_red.voxel), bricks_[0]);
  EXPECT_EQ(corners_.directionsAt(beside_red), 1u | 1u << 4);
  corners_.setBrick(0, 0, brickOf(beside_red.voxel), nullptr);
  EXPECT_EQ(corners_.directionsAt(beside_red), 1u << 4);
  EXPECT_EQ(at(3, 3).painted, 0);
  EXPECT_EQ(at(5, 3).painted, 0);
}

/// That of a refined triangle's side has the mean of its ends, of which one may not be painted.
TEST_F(VertexColourAround, WhatIsNearerIsTakenAlone) {
  const int blue = voxelIndex(3, 6, 3);
  bricks_[brickOf(blue)][placeInBrick(blue)] = {0, 0, 200, kRed.weight};
  EXPECT_EQ(at(4, 3).blue, 0) << "red beside, blue two voxels away";
  EXPECT_EQ(at(5, 3).red, 0) << "blue beside, red two voxels away";
  EXPECT_EQ(at(5, 3).blue, 200);
}

TEST_F(VertexColourAround, AMiddleIsBetweenItsEnds) {
  const int painted = edgeNumber(cornerIndex(3, 3, 3), 0, 0);
  const int beside = edgeNumber(cornerIndex(3, 6, 3), 0, 0);
  const int far = edgeNumber(cornerIndex(3, 6, 6), 0, 0);
  const auto middle = [this](int a, int b) {
    return meanColour(edgeColour(corners_, a, true), edgeColour(corners_, b, true));
  };
  EXPECT_EQ(middle(painted, beside).red, 200);
  EXPECT_EQ(middle(beside, painted).painted, 255);
  EXPECT_EQ(middle(beside, far).painted, 0);
  EXPECT_EQ(meanColour({200, 0, 7, 255}, {100, 50, 8, 255}).red, 150);
  EXPECT_EQ(meanColour({200, 0, 7, 255}, {100, 50, 8, 255}).green, 25);
  EXPECT_EQ(meanColour({200, 0, 7, 255}, {100, 50, 8, 255}).blue, 8);
}

/// Within two voxels, as far as the corners of the block.
TEST_F(VertexColourAround, IsThatOfWhatIsPaintedNearby) {
  for (int y = 0; y < kBlockSide; ++y) {
    for (int z = 0; z < kBlockSide; ++z) {
      const bool is_beside = y >= 1 && y <= 5 && z >= 1 && z <= 5;
      EXPECT_EQ(at(y, z).painted != 0, is_beside) << y << " " << z;
      EXPECT_EQ(at(y, z).red, is_beside ? 200 : 0) << y << " " << z;
    }
  }
  EXPECT_EQ(at(4, 3, 1).painted, 0) << "the other side of a thin thing has not been seen";
}

}  // namespace vertex_colour_test
}  // namespace dtsdf
