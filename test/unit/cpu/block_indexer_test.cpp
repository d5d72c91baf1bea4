// The vertices of a block on the CPU against the rule for each, from samples looked up in the map.
#include "cpu/block_indexer.h"

#include <gtest/gtest.h>

#include <random>

namespace dtsdf {
namespace {

/// A block and those around it, with random voxels: weights that differ by magnitudes from corner
/// to corner make borders everywhere. @return the number of vertices that are moved.
int compareVertices(uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> sdf(-1.0f, 1.0f);
  const BlockKey key{3, -2, 5};
  BlockTable table(size_t{64} << 20);
  std::vector<BlockRequest> requests;
  for (int n = 0; n < kBlocksAround; ++n) {
    if (n % 5 != 1) requests.push_back({packKey(key + aroundOffset(n)), n % 2 ? 0x3fu : 0x15u});
  }
  VoxelStore voxels;
  const Admission admission = table.admit(requests);
  voxels.resize(table.arrayCount());
  for (const int32_t array : admission.new_arrays) {
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      voxels.array(array)[i] =
          makeVoxel(storedSdf(sdf(random)), static_cast<uint16_t>(random() % 64001),
                    1u << random() % 22, random() % 4);
    }
  }
  const ArraysAround arrays = arraysAround(table, voxels, slotsAround(table, key), 1);
  const MeshSettings rules;
  MeshSettings unheld;
  unheld.measured_pull = 0.0f;
  BlockIndexer indexer;
  int moved = 0;
  for (const BlockVertex& vertex : indexer.index(rules, arrays, true).vertices) {
    const int edge = static_cast<int>(vertex.edge);
    const EdgeVoxels voxels(arrays, edge, true, kAllDirections);
    const Vec3f held = voxels.vertex(rules, voxels.crossing()).position;
    const Vec3f free = voxels.vertex(unheld, voxels.crossing()).position;
    EXPECT_EQ(vertex.position.x, held.x) << edge;
    EXPECT_EQ(vertex.position.y, held.y) << edge;
    EXPECT_EQ(vertex.position.z, held.z) << edge;
    moved += norm(held - free) > 0.0f ? 1 : 0;
  }
  return moved;
}

TEST(BlockIndexer, MakesVerticesAsOneByOne) {
  int moved = 0;
  for (uint32_t seed = 1; seed <= 20; ++seed) moved += compareVertices(seed);
  EXPECT_GT(moved, 50);
}

}  // namespace
}  // namespace dtsdf
