// Tests that a map that has used up its budget keeps and updates its blocks, while further blocks
// are refused and counted.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <vector>

#include "kernels/core/grid.h"
#include "mapper/probed_mapper.h"
#include "support/block_snapshot.h"
#include "support/depth_frames.h"
#include "support/map_equality.h"
#include "support/mesh_topology.h"
#include "support/raw_mesh.h"

namespace dtsdf {
namespace {

constexpr size_t kBudget = size_t(3) << 20;

MapperParams smallParams(bool directional) {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, directional, 0.02f);
  params.map.max_memory_mb = 3;
  return params;
}

const std::vector<SceneFrame>& lap() {
  static std::vector<SceneFrame> frames;
  if (!frames.empty()) return frames;
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 6; ++i) poses.push_back(roomCameraPose(0.8 * i));
  frames = renderFrames(makeRoomScene(), poses, 120, 90);
  return frames;
}

class Budget : public testing::TestWithParam<bool> {};

TEST_P(Budget, IsNotExceededAndRefusalsAreCounted) {
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(smallParams(GetParam()));
  uint64_t refused = 0;
  for (const SceneFrame& frame : lap()) {
    const IntegrationResult result = mapper->integrate(frame.view());
    EXPECT_EQ(result.status, FrameStatus::kFused);
    refused += result.refused_blocks;
    const MapStats stats = mapper->stats();
    EXPECT_LE(stats.map_bytes, kBudget);
    EXPECT_EQ(stats.max_map_bytes, kBudget);
    EXPECT_EQ(stats.refused_blocks, refused);
  }
  EXPECT_GT(refused, 0u);
  mapper->clear();
  EXPECT_EQ(mapper->stats().refused_blocks, 0u);
}

TEST_P(Budget, ScratchMemoryIsReported) {
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(smallParams(GetParam()));
  EXPECT_FALSE(mapper->memory().on_gpu);
  const SceneFrame& frame = lap()[0];
  const MapperMemory before = mapper->memory();
  mapper->integrate(frame.view());
  mapper->updateMesh();
  const MapperMemory after = mapper->memory();
  // At least the inverse depth and the free depth of each pixel.
  EXPECT_GE(after.scratch, before.scratch + 2 * sizeof(float) * frame.depth_m.size());
  EXPECT_EQ(after.meshes + after.staging, 0u);
}

/// All arrays within the budget have the same distances and states as with a larger budget.
TEST_P(Budget, MappedVoxelsAreCorrect) {
  MapperParams plenty_params = smallParams(GetParam());
  plenty_params.map.max_memory_mb = 1024;
  const std::unique_ptr<ProbedMapper> small = makeProbedMapper(smallParams(GetParam()));
  const std::unique_ptr<ProbedMapper> plenty = makeProbedMapper(plenty_params);
  const SceneFrame& frame = lap()[0];
  EXPECT_GT(small->integrate(frame.view()).refused_blocks, 0u);
  EXPECT_EQ(plenty->integrate(frame.view()).refused_blocks, 0u);
  std::map<PackedKey, BlockSnapshot> all;
  for (const BlockSnapshot& block : snapshotOf(*plenty)) all.emplace(packKey(block.key), block);
  size_t compared = 0;
  for (const BlockSnapshot& block : snapshotOf(*small)) {
    const BlockSnapshot& whole = all.at(packKey(block.key));
    for (int d = 0; d < kDirectionCount; ++d) {
      if (block.voxels[d].empty()) continue;
      ASSERT_EQ(whole.voxels[d].size(), block.voxels[d].size());
      for (size_t i = 0; i < block.voxels[d].size(); ++i) {
        ASSERT_EQ(whole.voxels[d][i].sdf_units, block.voxels[d][i].sdf_units);
        ASSERT_EQ(whole.voxels[d][i].state, block.voxels[d][i].state);
      }
      ++compared;
    }
  }
  EXPECT_GT(compared, 100u);
}

TEST_P(Budget, AFullMapIsStillUpdatedAndMeshed) {
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(smallParams(GetParam()));
  const SceneFrame& frame = lap()[0];
  mapper->integrate(frame.view());
  MeshStore store(0.02f);
  store.apply(mapper->updateMesh());
  const size_t triangles = store.triangleCount();
  EXPECT_GT(triangles, 100u);
  const auto weight = [&] {
    double sum = 0.0;
    for (const BlockSnapshot& block : snapshotOf(*mapper)) {
      for (const auto& voxels : block.voxels) {
        for (const Voxel& voxel : voxels) sum += weightOf(voxel);
      }
    }
    return sum;
  };
  const double before = weight();
  mapper->integrate(frame.view());
  EXPECT_NEAR(weight() / before, 2.0, 1e-3);
  store.apply(mapper->updateMesh());
  const Mesh mesh = store.assemble();
  const MeshTopology topology = measureTopology(rawMesh(store));
  EXPECT_EQ(topology.repeated_corners + topology.zero_areas, 0u) << topology;
  const Scene scene = makeRoomScene();
  EXPECT_LT(measureError(mesh, scene).rms_m, 0.5 * 0.02);
}

INSTANTIATE_TEST_SUITE_P(Maps, Budget, testing::Bool(),
                         [](const testing::TestParamInfo<bool>& info) {
                           return info.param ? "Directional" : "Undirected";
                         });

/// Blocks that a frame only touches, without updating a voxel, are removed from the map.
TEST(Recycling, LeavesNoEmptyArrays) {
  for (const FusionMode mode :
       {FusionMode::kVoxelProjection, FusionMode::kRayCasting, FusionMode::kNormalRayCasting}) {
    const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(makeCpuParams(mode, true, 0.04f));
    size_t arrays = 0;
    for (const SceneFrame& frame : lap()) mapper->integrate(frame.view());
    for (const BlockSnapshot& block : snapshotOf(*mapper)) {
      for (const auto& voxels : block.voxels) {
        if (voxels.empty()) continue;
        ++arrays;
        bool observed = false;
        for (const Voxel& voxel : voxels) observed |= !isEmpty(voxel);
        EXPECT_TRUE(observed);
      }
    }
    EXPECT_EQ(mapper->stats().voxel_arrays, arrays);
  }
}

}  // namespace
}  // namespace dtsdf
