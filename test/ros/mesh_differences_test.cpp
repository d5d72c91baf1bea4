#include "ros/steps/mesh_queue.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

SharedBlockMesh block(int x, float position, size_t triangles = 1, uint8_t red = 7) {
  auto mesh = std::make_shared<BlockMesh>();
  mesh->key = {x, 0, 0};
  mesh->vertices = {{{position, 0.0f, 0.0f}, 0}};
  mesh->triangles.resize(3 * triangles);
  mesh->colours = {{red, 0, 0, 255}};
  return mesh;
}

TEST(MeshDifferences, AreWhatChangedCameOrWent) {
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

TEST(MeshDifferences, OfEqualMeshesThereAreNone) {
  MeshStore store(0.05f);
  for (int x = 0; x < 4; ++x) store.put(block(x, 0.25f));
  std::vector<SharedBlockMesh> same = {block(7, 0.0f, 0)};  // empty, and not shown
  for (int x = 0; x < 4; ++x) same.push_back(block(x, 0.25f));
  EXPECT_TRUE(differences(store, same).empty());
  EXPECT_EQ(differences(store, {}).size(), 4u) << "all went";
}

}  // namespace
}  // namespace dtsdf
