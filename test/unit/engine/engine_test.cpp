// The engine alone admits, counts, forgets, and orders the stages: with an idle backend.
#include "engine/engine.h"

#include <gtest/gtest.h>

#include "map/memory_budget.h"
#include "unit/engine/recorder.h"

namespace dtsdf {
namespace {

using Calls = std::vector<std::string>;

class EngineTest : public testing::Test {
 protected:
  EngineTest() { params_.map.max_memory_mb = 1; }

  Engine makeEngine() {
    return Engine(params_, Rules(), 1,
                  [this](const BlockTable&) { return std::make_unique<Recorder>(script_); });
  }

  /// So many blocks in a row that begins at the camera and leads away from it.
  void request(int count) {
    script_.requests.clear();
    for (int i = 0; i < count; ++i) script_.requests.push_back({packKey({0, 0, i}), 1});
  }

  DepthFrame depthFrame() const {
    DepthFrame frame;
    frame.data = pixel_;
    frame.width = frame.height = 1;
    frame.row_bytes = sizeof(float);
    frame.encoding = DepthEncoding::kFloat32;
    frame.intrinsics = {1.0f, 1.0f, 0.0f, 0.0f};
    return frame;
  }

  ColourFrame colourFrame() const {
    ColourFrame frame;
    frame.data = pixel_;
    frame.width = frame.height = 1;
    frame.row_bytes = 3;
    frame.intrinsics = {1.0f, 1.0f, 0.0f, 0.0f};
    return frame;
  }

  MapperParams params_;
  Script script_;
  const float pixel_[1] = {0.0f};
};

constexpr size_t kBlock = BlockTable::kBlockBytes + BlockTable::kArrayBytes;
constexpr size_t kMostBlocks = (size_t(7) << 17) / kBlock;  // 1 MiB less an eighth for free cells

TEST_F(EngineTest, OrdersTheStages) {
  params_.space.enabled = true;
  Engine engine = makeEngine();
  request(2);
  script_.colour_requests = {{packKey({0, 0, 0}), 1}};
  engine.integrate(depthFrame());
  EXPECT_EQ(script_.takeCalls(), (Calls{"sense", "make surfels", "find blocks", "look up blocks",
                                        "see free", "admit", "cast, fold, clear"}));
  for (int image = 0; image < 2; ++image) {
    engine.paint(colourFrame());
    EXPECT_EQ(script_.takeCalls(),
              image == 0 ? (Calls{"take colours", "look", "keep colours", "admit colours", "paint"})
                         : (Calls{"take colours", "look", "paint"}));
  }
  engine.updateMesh();
  EXPECT_EQ(script_.takeCalls(), (Calls{"mark all", "begin mesh", "finish mesh"}));
  engine.updateMesh();
  EXPECT_EQ(script_.takeCalls(), (Calls{"begin mesh", "finish mesh"}));
}

TEST_F(EngineTest, LeavesAFrameWithoutBlocksOut) {
  Engine engine = makeEngine();
  EXPECT_EQ(engine.integrate(depthFrame()).status, FrameStatus::kNoMeasurement);
  EXPECT_EQ(script_.takeCalls().back(), "look up blocks");
  EXPECT_EQ(engine.contents().frames, 0u);
}

TEST_F(EngineTest, AdmitsWithinTheBudgetAndCounts) {
  params_.space.enabled = true;
  Engine engine = makeEngine();
  constexpr size_t kTooMany = 5;
  request(static_cast<int>(kMostBlocks + kTooMany));
  EXPECT_EQ(engine.integrate(depthFrame()).refused_blocks, kTooMany);
  EXPECT_EQ(script_.entered.size(), kMostBlocks);
  EXPECT_EQ(script_.zeroed.size(), kMostBlocks);
  EXPECT_EQ(script_.frame_number, 1u);
  EXPECT_EQ(engine.integrate(depthFrame()).refused_blocks, kTooMany);
  EXPECT_EQ(script_.frame_number, 2u);
  EXPECT_EQ(script_.in_view.size(), kMostBlocks);
  const MapStats stats = engine.stats();
  EXPECT_EQ(stats.blocks, kMostBlocks);
  EXPECT_EQ(stats.map_bytes, kMostBlocks * kBlock);
  EXPECT_EQ(stats.refused_blocks, 2 * kTooMany);
  EXPECT_EQ(stats.free_bytes, kFreeCubeBudgetBytes);
  EXPECT_EQ(engine.contents().supporting_frames, 2u);
}

TEST_F(EngineTest, ReleasesWhatAFrameLeavesEmptyWhenTheMapIsLookedAt) {
  Engine engine = makeEngine();
  request(3);
  engine.integrate(depthFrame());
  script_.empty = {{script_.entered[1], 1}};
  engine.outline();
  EXPECT_EQ(engine.stats().blocks, 2u);
  EXPECT_EQ(script_.followed, std::vector<int32_t>{script_.entered[1]});
  engine.updateMesh();
  script_.empty = {{script_.entered[0], 1}};
  engine.outline();
  EXPECT_EQ(engine.stats().blocks, 2u) << "a mesh of it may be shown";
  engine.updateMesh();
  EXPECT_EQ(engine.stats().blocks, 1u);
}

TEST_F(EngineTest, FusesWithoutMemoryForBlocksAndRefusesWithoutAnyForTheFrame) {
  Engine engine = makeEngine();
  request(3);
  script_.lacks_blocks = true;
  const IntegrationResult result = engine.integrate(depthFrame());
  EXPECT_EQ(result.status, FrameStatus::kFused);
  EXPECT_EQ(result.refused_blocks, 3u);
  script_.lacks_frame = true;
  EXPECT_EQ(engine.integrate(depthFrame()).status, FrameStatus::kNoMemory);
  EXPECT_EQ(engine.contents().frames, 1u);
}

/// Blocks that a device has got are listed later; a failure in between must not make them twice.
TEST_F(EngineTest, ListsBlocksThatAFailureHasLeft) {
  script_.has_mirror = true;
  Engine engine = makeEngine();
  request(2);
  script_.lacks_host = true;
  EXPECT_THROW(engine.integrate(depthFrame()), std::bad_alloc);
  EXPECT_EQ(script_.entered.size(), 2u);
  script_.lacks_host = false;
  request(3);
  EXPECT_EQ(engine.integrate(depthFrame()).status, FrameStatus::kFused);
  EXPECT_EQ(script_.entered, std::vector<int32_t>{2});
  EXPECT_EQ(engine.stats().blocks, 3u);
}

TEST_F(EngineTest, DropsClearsAndRestores) {
  params_.map.keep_radius_m = 0.2f;  // voxels of 5 cm: within the first block
  params_.map.voxel_size_m = 0.05f;
  Engine engine = makeEngine();
  request(3);
  engine.integrate(depthFrame());
  EXPECT_EQ(engine.stats().dropped_blocks, 2u);
  const MapContents contents = engine.contents();
  EXPECT_EQ(engine.clearRegion(SphereRegion{Eigen::Vector3d::Zero(), 100.0}).blocks, 1u);
  engine.clear();
  EXPECT_EQ(engine.stats().dropped_blocks, 0u);
  engine.restore(contents);
  EXPECT_EQ(script_.made, 2) << "a map of its own after clear()";
  EXPECT_EQ(engine.stats().blocks, 1u);
  EXPECT_EQ(engine.contents().frames, 1u);
  EXPECT_EQ(script_.takeCalls().back(), "copy out");
}

}  // namespace
}  // namespace dtsdf
