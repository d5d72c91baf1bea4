#include "ros/steps/mesh_queue.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

MeshUpdate makeUpdate(const std::vector<BlockKey>& keys, size_t triangles) {
  MeshUpdate update;
  for (const BlockKey& key : keys) {
    update.blocks.push_back({key, {}, std::vector<uint16_t>(3 * triangles), {}});
  }
  return update;
}

class MeshQueueTest : public testing::Test {
 protected:
  int wakes_ = 0;
  MeshQueue queue_{[this] { ++wakes_; }};
};

TEST_F(MeshQueueTest, ReturnsEachChangeOnce) {
  queue_.add(makeUpdate({{0, 0, 0}, {1, 0, 0}}, 1), ros::Time(5.0));
  EXPECT_EQ(wakes_, 1);
  const MeshChanges changes = queue_.take();
  EXPECT_FALSE(changes.cleared);
  EXPECT_EQ(changes.blocks.size(), 2u);
  EXPECT_EQ(changes.stamp, ros::Time(5.0));
  EXPECT_TRUE(queue_.take().blocks.empty());
}

TEST_F(MeshQueueTest, DoesNotCopyTheMeshes) {
  MeshUpdate update = makeUpdate({{0, 0, 0}}, 1000);
  const uint16_t* const triangles = update.blocks[0].triangles.data();
  queue_.add(std::move(update), ros::Time(1.0));
  EXPECT_EQ(queue_.take().blocks.begin()->second->triangles.data(), triangles);
}

TEST_F(MeshQueueTest, EmptyUpdatesWakeNobody) {
  queue_.add({}, ros::Time(1.0));
  EXPECT_EQ(wakes_, 0);
  EXPECT_TRUE(queue_.take().stamp.isZero());
}

TEST_F(MeshQueueTest, KeepsOnlyTheNewestMeshPerBlock) {
  for (size_t i = 1; i <= 100; ++i) {
    queue_.add(makeUpdate({{0, 0, 0}, {-1, 2, 3}}, i), ros::Time(static_cast<double>(i)));
  }
  const MeshChanges changes = queue_.take();
  ASSERT_EQ(changes.blocks.size(), 2u) << "the queue should contain at most one mesh per block";
  for (const auto& [key, block] : changes.blocks) EXPECT_EQ(block->triangles.size(), 300u);
  EXPECT_EQ(changes.stamp, ros::Time(100.0));
}

TEST_F(MeshQueueTest, ClearingDiscardsWaitingChanges) {
  queue_.add(makeUpdate({{0, 0, 0}}, 1), ros::Time(1.0));
  queue_.clear(0.02f);
  EXPECT_EQ(wakes_, 2);
  queue_.add(makeUpdate({{7, 0, 0}}, 1), ros::Time(2.0));
  const MeshChanges changes = queue_.take();
  EXPECT_TRUE(changes.cleared);
  ASSERT_EQ(changes.blocks.size(), 1u);
  EXPECT_EQ(changes.blocks.begin()->second->key.x, 7);
  EXPECT_FALSE(queue_.take().cleared);
}

TEST_F(MeshQueueTest, AWholeMeshChangesAddsAndRemovesBlocks) {
  PagedMeshes meshes{MapParams()};
  const auto replaceBy = [&](const std::vector<std::pair<int, size_t>>& blocks) {
    std::map<PackedKey, SharedBlockMesh> mesh;
    for (const auto& [x, triangles] : blocks) {
      const BlockMesh block{{x, 0, 0}, {}, std::vector<uint16_t>(3 * triangles), {}};
      mesh[packedKeyOf(block.key)] = std::make_shared<BlockMesh>(block);
    }
    queue_.replaceAll(mesh, ros::Time(1.0));
    MeshChanges changes = queue_.take();
    apply(changes, meshes);
    return changes.blocks.size();
  };
  EXPECT_EQ(replaceBy({{0, 1}, {1, 1}, {2, 1}, {7, 0}}), 3u);
  EXPECT_EQ(replaceBy({{0, 1}, {1, 1}, {2, 1}, {7, 0}}), 0u);
  EXPECT_EQ(replaceBy({{0, 1}, {1, 2}, {9, 1}}), 3u);
  EXPECT_EQ(meshes.triangleCount(), 4u);
  EXPECT_EQ(meshes.find(packedKeyOf({2, 0, 0})), nullptr);
}

}  // namespace
}  // namespace dtsdf
