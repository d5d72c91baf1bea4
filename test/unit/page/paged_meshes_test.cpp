// Compares block meshes, some of which are on disk, with a store that keeps all of them in memory.
#include "page/paged_meshes.h"

#include <gtest/gtest.h>

#include <random>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/saved_mesh.h"
#include "kernels/core/grid.h"
#include "mapper/probed_mapper.h"
#include "simulation/scene.h"
#include "support/depth_frames.h"
#include "support/page_faults.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr float kPagedVoxel_m = 0.04f;

/// The block meshes of a room from eight mesh updates, in the order of the updates.
const std::vector<SharedBlockMesh>& meshesOfARoom() {
  static const std::vector<SharedBlockMesh> meshes = [] {
    Scene scene;
    scene.add(Room{Eigen::Vector3d(-2.0, -2.0, -1.2), Eigen::Vector3d(2.0, 2.0, 1.2)});
    MapperParams params;
    params.backend = Backend::kCpu;
    params.map.voxel_size_m = kPagedVoxel_m;
    const auto mapper = makeProbedMapper(params);
    std::vector<SharedBlockMesh> made;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d ahead(std::cos(0.8 * i), std::sin(0.8 * i), 0.0);
      const SceneFrame frame = renderFrame(
          scene, lookAt(Eigen::Vector3d::Zero(), ahead, Eigen::Vector3d::UnitZ()), 160, 120);
      for (int k = 0; k < 3; ++k) mapper->integrate(frame.view());
      for (BlockMesh& block : mapper->updateMesh().blocks) {
        made.push_back(std::make_shared<const BlockMesh>(std::move(block)));
      }
    }
    return made;
  }();
  return meshes;
}

SharedBlockMesh painted(const BlockMesh& block, uint8_t red) {
  auto copy = std::make_shared<BlockMesh>(block);
  copy->colours.assign(copy->vertices.size(), VertexColour{red, 2, 3, 255});
  return copy;
}

MapParams paramsIn(const std::string& folder) {
  MapParams params;
  params.voxel_size_m = kPagedVoxel_m;
  params.max_memory_mb = 1;  // meshes get an eighth of this budget
  params.page_folder = folder;
  params.page_max_gb = 1.0f;
  return params;
}

class PagedMeshesTest : public testing::Test {
 protected:
  void put(const SharedBlockMesh& block) {
    meshes_.put(block);
    reference_.put(block);
  }
  void putAll() {
    for (const SharedBlockMesh& block : meshesOfARoom()) put(block);
    ASSERT_TRUE(meshes_.isPaged());
  }

  void expectSame() {
    std::vector<PackedKey> keys;
    for (const auto& [key, block] : reference_.blocks()) {
      keys.push_back(key);
      const SharedBlockMesh found = meshes_.find(key);
      ASSERT_TRUE(found);
      EXPECT_EQ(packKey(found->key), key);
      EXPECT_EQ(found->triangles, block->triangles);
      ASSERT_EQ(found->vertices.size(), block->vertices.size());
      ASSERT_EQ(found->colours.size(), block->colours.size());
      EXPECT_EQ(std::memcmp(found->vertices.data(), block->vertices.data(),
                            block->vertices.size() * sizeof(BlockVertex)),
                0);
    }
    EXPECT_EQ(meshes_.keys(), keys);
    EXPECT_EQ(meshes_.triangleCount(), reference_.triangleCount());
  }

  /// Bytes of the mesh file as the node writes it, in pieces.
  std::string savedPiecewise() {
    savePagedMesh(meshes_, MeshColour::kAuto, folder_ / "pieces.ply");
    return readBytes(folder_ / "pieces.ply");
  }
  std::string savedAtOnce() {
    saveMesh(reference_.assemble(), MeshColour::kAuto, folder_ / "whole.ply");
    return readBytes(folder_ / "whole.ply");
  }

  bool isFileSpaceFreed() const {
    return lseek(openFilesIn(pages_.path()).front(), 0, SEEK_END) == 0;
  }

  TemporaryFolder folder_, pages_;
  PagedMeshes meshes_{paramsIn(pages_.path())};
  MeshStore reference_{kPagedVoxel_m};
};

TEST(MeshesInMemory, ReportWhetherABlockChanged) {
  PagedMeshes meshes{MapParams()};
  const SharedBlockMesh& block = meshesOfARoom().front();
  EXPECT_TRUE(meshes.put(block));
  EXPECT_FALSE(meshes.put(std::make_shared<const BlockMesh>(*block)));
  EXPECT_TRUE(meshes.put(painted(*block, 1)));
}

TEST_F(PagedMeshesTest, AreReadBackUnchanged) {
  ASSERT_NO_FATAL_FAILURE(putAll());
  EXPECT_LE(meshes_.bytes(), meshes_.maxBytes());
  EXPECT_GT(meshes_.stats().bytes, 2 * meshes_.maxBytes()) << "most meshes should be on disk";
  ASSERT_NO_FATAL_FAILURE(expectSame());
  EXPECT_TRUE(savedPiecewise() == savedAtOnce());
  EXPECT_EQ(meshes_.stats().failures + meshes_.stats().lost, 0u);
  EXPECT_EQ(pages_.entryCount(), 0u) << "the page file should not be visible in its folder";
}

/// Random meshes, in memory or on disk, are replaced by painted ones or removed.
TEST_F(PagedMeshesTest, FollowChanges) {
  ASSERT_NO_FATAL_FAILURE(putAll());
  std::mt19937 random(3);
  const std::vector<SharedBlockMesh>& all = meshesOfARoom();
  for (int i = 0; i < 2000; ++i) {
    const BlockMesh& block = *all[random() % all.size()];
    if (i % 3 == 0) {
      auto none = std::make_shared<BlockMesh>();
      none->key = block.key;
      put(none);
    } else {
      put(painted(block, static_cast<uint8_t>(i)));
    }
    ASSERT_LE(meshes_.bytes(), meshes_.maxBytes());
  }
  EXPECT_TRUE(meshes_.isPainted());
  ASSERT_NO_FATAL_FAILURE(expectSame());
  EXPECT_TRUE(savedPiecewise() == savedAtOnce());
  for (const PackedKey key : meshes_.keys()) {
    auto none = std::make_shared<BlockMesh>();
    none->key = unpackKey(key);
    meshes_.put(none);
  }
  EXPECT_EQ(meshes_.triangleCount() + meshes_.bytes() + meshes_.stats().bytes, 0u);
  EXPECT_FALSE(meshes_.isPainted());
  EXPECT_TRUE(isFileSpaceFreed());
}

TEST_F(PagedMeshesTest, DetectDamage) {
  ASSERT_NO_FATAL_FAILURE(putAll());
  const size_t blocks = meshes_.keys().size();
  damagePages(pages_.path(), 1, 0);
  size_t found = 0;
  for (const PackedKey key : meshes_.keys()) found += meshes_.find(key) ? 1 : 0;
  EXPECT_EQ(found, blocks - 1);
  EXPECT_EQ(meshes_.stats().lost, 1u);
  EXPECT_NE(meshes_.stats().problem.find("damaged"), std::string::npos);
  putAll();
  expectSame();
}

/// Meshes that cannot be written stay in memory until the disk accepts them again.
TEST_F(PagedMeshesTest, SurviveFailedWrites) {
  {
    const FileSizeLimit disk(100000);
    for (const SharedBlockMesh& block : meshesOfARoom()) put(block);
  }
  EXPECT_GT(meshes_.bytes(), meshes_.maxBytes());
  EXPECT_GT(meshes_.stats().failures, 0u);
  EXPECT_NE(meshes_.stats().problem.find("map/page_folder"), std::string::npos);
  ASSERT_NO_FATAL_FAILURE(expectSame());
  for (int i = 0; i < 70; ++i) put(meshesOfARoom().back());  // until writing is retried
  EXPECT_LE(meshes_.bytes(), meshes_.maxBytes());
  expectSame();
}

TEST_F(PagedMeshesTest, AreRemovedByClearing) {
  ASSERT_NO_FATAL_FAILURE(putAll());
  meshes_.clear(0.1f);
  EXPECT_EQ(meshes_.voxelSize(), 0.1f);
  EXPECT_EQ(meshes_.triangleCount() + meshes_.bytes() + meshes_.stats().bytes, 0u);
  EXPECT_TRUE(meshes_.keys().empty());
  EXPECT_TRUE(isFileSpaceFreed());
  reference_.clear();
  putAll();
  expectSame();
}

}  // namespace
}  // namespace dtsdf
