// The colours of a block's vertices against the rule for each.
#include "cpu/vertex_colours.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>

namespace dtsdf {
namespace {

/// Blocks of noise, of which some arrays, bricks and voxels are not there; `share` of the voxels
/// are painted.
class NoisyCorners {
 public:
  NoisyCorners(unsigned seed, double share) : random_(seed), is_painted_(share) {
    corners_.voxels.least_evidence = 1;
    for (int n = 0; n < kCornerBlocks; ++n) {
      for (int d = 0; d < kDirectionCount; ++d) {
        if (random_() % 3 != 0) fill(n, d);
      }
    }
  }

  const ColouredCorners& corners() const { return corners_; }

  /// Some edges in ascending order, then some middles between them and others.
  std::vector<BlockVertex> vertices() {
    std::vector<BlockVertex> vertices;
    for (int edge = 0; edge < kGridEdges; ++edge) {
      if (random_() % 5 == 0 && isInGrid(edge)) vertices.push_back({{}, uint32_t(edge)});
    }
    for (int i = 0; i < 300; ++i) {
      vertices.push_back({{}, middleNumber(anyEdge(), anyEdge())});
    }
    return vertices;
  }

 private:
  static bool isInGrid(int edge) {
    return component(cornerAt(edgeCorner(edge)), edgeAxis(edge)) < kBlockSide;
  }

  int anyEdge() {
    int edge = 0;
    do edge = static_cast<int>(random_() % kGridEdges);
    while (!isInGrid(edge));
    return edge;
  }

  void fill(int n, int d) {
    Voxel* const voxels = voxels_[n][d];
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      voxels[i] = makeVoxel(0.5f * distance_(random_), random_() % 100000,
                            static_cast<int32_t>(random_() % 4));
    }
    corners_.voxels.array[n][d] = voxels;
    for (int brick = 0; brick < kBricksPerArray; ++brick) {
      if (random_() % 4 == 0) continue;
      VoxelColour* const colours = colours_[n][d][brick];
      for (int i = 0; i < kVoxelsPerBrick; ++i) {
        const auto weight = static_cast<uint8_t>(is_painted_(random_) ? 1 + random_() % 255 : 0);
        colours[i] = {byte(), byte(), byte(), weight};
      }
      corners_.setBrick(n, d, brick, colours);
    }
  }

  uint8_t byte() { return static_cast<uint8_t>(random_() & 255); }

  std::mt19937 random_;
  std::bernoulli_distribution is_painted_;
  std::normal_distribution<float> distance_;
  Voxel voxels_[kCornerBlocks][kDirectionCount][kVoxelsPerBlock] = {};
  VoxelColour colours_[kCornerBlocks][kDirectionCount][kBricksPerArray][kVoxelsPerBrick] = {};
  ColouredCorners corners_ = {};
};

class VertexColours : public testing::TestWithParam<double> {};

TEST_P(VertexColours, AreThoseOfOneAtATime) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const auto noise = std::make_unique<NoisyCorners>(seed, GetParam());
    const std::vector<BlockVertex> vertices = noise->vertices();
    for (const bool directional : {true, false}) {
      const std::vector<VertexColour> colours =
          vertexColours(noise->corners(), vertices, directional);
      ASSERT_EQ(colours.size(), vertices.size());
      for (size_t i = 0; i < vertices.size(); ++i) {
        const VertexColour one = vertexColourOf(noise->corners(), vertices[i].edge, directional);
        ASSERT_EQ(0, std::memcmp(&colours[i], &one, sizeof(one))) << seed << " " << i;
      }
    }
  }
}

TEST(VertexColoursOfNothing, AreNone) {
  EXPECT_TRUE(vertexColours(ColouredCorners{}, {}, true).empty());
  const std::vector<VertexColour> unpainted =
      vertexColours(ColouredCorners{}, {{{}, 0}, {{}, middleNumber(0, 6)}}, true);
  ASSERT_EQ(unpainted.size(), 2u);
  EXPECT_EQ(unpainted[0].painted, 0);
  EXPECT_EQ(unpainted[1].painted, 0);
}

/// All painted, most, and so few that some vertices find nothing within their reach.
INSTANTIATE_TEST_SUITE_P(Shares, VertexColours, testing::Values(1.0, 0.7, 0.02, 0.0005));

}  // namespace
}  // namespace dtsdf
