// The make stage of a block against the rules applied unit by unit.
#include "cpu/block_surface.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "kernels/meshing/sheets.h"

namespace dtsdf {
namespace {

/// Labels of all units in a block and around it, of which a half say nothing, and some whole
/// blocks.
class RandomBlocks {
 public:
  explicit RandomBlocks(std::mt19937& random) : blocks_(kBlocksAround) {
    for (int n = 0; n < kBlocksAround; ++n) {
      if (n != aroundNumber({0, 0, 0}) && random() % 4 == 0) continue;
      blocks_[n].resize(kVoxelsPerBlock);
      for (UnitLabels& labels : blocks_[n]) labels = randomLabels(random);
    }
  }

  UnitLabels operator()(const Vec3i& unit) const {
    const UnitSource source = unitSource(unit);
    const auto& block = blocks_[static_cast<size_t>(source.block)];
    return block.empty() ? UnitLabels{0, 0} : block[static_cast<size_t>(source.unit)];
  }

  void point(LabelNeighbourhood& labels) const {
    for (size_t n = 0; n < kBlocksAround; ++n) {
      labels[n] = blocks_[n].empty() ? nullptr : blocks_[n].data();
    }
  }

 private:
  static UnitLabels randomLabels(std::mt19937& random) {
    if (random() % 2 == 0) return {0, 0};
    const auto sheet = [&] { return random() % 4 == 0 ? kNotKnown : int(random() % 256); };
    const int first = sheet();
    return joinSheets(first, sheet());
  }

  std::vector<std::vector<UnitLabels>> blocks_;
};

/// The indices of a unit, from the eight units around each of its corners.
UnitIndices regularOneByOne(const RandomBlocks& blocks, const Vec3i& unit) {
  unsigned behind = 0;
  for (int c = 0; c < kCubeCorners; ++c) {
    if (isBehindForMost(cornerBalance(blocks, unit + cornerOffset(c)))) behind |= 1u << c;
  }
  return regularise(blocks(unit), behind);
}

TEST(BlockSurface, CornersAreSettledByAllUnitsAround) {
  std::mt19937 random(23);
  const auto surface = std::make_unique<BlockSurface>();
  for (int trial = 0; trial < 20; ++trial) {
    const RandomBlocks blocks(random);
    LabelNeighbourhood labels;
    blocks.point(labels);
    surface->regularise(labels, 0);
    size_t next = 0;
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const Vec3i unit = voxelOffset(i);
      const UnitIndices expected = regularOneByOne(blocks, unit);
      if (countTriangles(kMeshTables, expected) == 0) continue;
      ASSERT_LT(next, surface->units().size());
      const SurfaceUnit& found = surface->units()[next++];
      ASSERT_EQ(voxelIndex(found.at.x, found.at.y, found.at.z), i);
      ASSERT_EQ(found.indices.sheet[0], expected.sheet[0]);
      ASSERT_EQ(found.indices.sheet[1], expected.sheet[1]);
    }
    EXPECT_EQ(next, surface->units().size());
    EXPECT_GT(next, 50u);
  }
}

}  // namespace
}  // namespace dtsdf
