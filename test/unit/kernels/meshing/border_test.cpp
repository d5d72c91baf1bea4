// Which blocks the border's rule reads.
#include "kernels/meshing/border.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace dtsdf {
namespace {

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
      heldToBorder(RandomCorners{&random, &blocks}, edge, vertexPosition(edge, 0.5f));
    }
  }
  for (int n = 0; n < kBlocksAround; ++n) {
    const Vec3i from_read = Vec3i{0, 0, 0} - aroundOffset(n);
    EXPECT_EQ(blocks.count(n) == 1, hasVerticesOn(from_read)) << n;
  }
}

}  // namespace
}  // namespace dtsdf
