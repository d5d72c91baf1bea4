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
  EXPECT_EQ(queue_.take().blocks[0]->triangles.data(), triangles);
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
  for (const SharedBlockMesh& block : changes.blocks) EXPECT_EQ(block->triangles.size(), 300u);
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
  EXPECT_EQ(changes.blocks[0]->key.x, 7);
  EXPECT_FALSE(queue_.take().cleared);
}

SharedBlockMesh block(int x, float position, size_t triangles = 1, uint8_t red = 7) {
  auto mesh = std::make_shared<BlockMesh>();
  mesh->key = {x, 0, 0};
  mesh->vertices = {{{position, 0.0f, 0.0f}, 0}};
  mesh->triangles.resize(3 * triangles);
  mesh->colours = {{red, 0, 0, 255}};
  return mesh;
}

TEST(MeshDifferences, AreChangedAddedAndRemovedBlocks) {
  MeshStore store(0.05f);
  for (int x = 0; x < 4; ++x) store.put(block(x, 0.25f));
  const std::vector<SharedBlockMesh> changes =
      differences(store, {block(0, 0.25f), block(1, 0.5f), block(2, 0.25f, 1, 8), block(9, 0.0f)});
  ASSERT_EQ(changes.size(), 4u);
  for (const SharedBlockMesh& change : changes) store.put(change);
  EXPECT_EQ(store.blocks().size(), 4u);
  EXPECT_EQ(store.blocks().count(packedKeyOf({3, 0, 0})), 0u);
  EXPECT_EQ(store.blocks().at(packedKeyOf({1, 0, 0}))->vertices[0].position.x, 0.5f);
  EXPECT_EQ(store.blocks().at(packedKeyOf({2, 0, 0}))->colours[0].red, 8);
}

TEST(MeshDifferences, AreEmptyForEqualMeshes) {
  MeshStore store(0.05f);
  for (int x = 0; x < 4; ++x) store.put(block(x, 0.25f));
  std::vector<SharedBlockMesh> same = {block(7, 0.0f, 0)};  // empty, and not in the store
  for (int x = 0; x < 4; ++x) same.push_back(block(x, 0.25f));
  EXPECT_TRUE(differences(store, same).empty());
  EXPECT_EQ(differences(store, {}).size(), 4u) << "all blocks should be removed";
}

}  // namespace
}  // namespace dtsdf
