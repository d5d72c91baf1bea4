// What the engine makes of a backend that lacks memory, or finds nothing.
#include "engine/engine.h"

#include <gtest/gtest.h>

#include "unit/engine/recorder.h"

namespace dtsdf {
namespace {

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

  MapperParams params_;
  Script script_;
  const float pixel_[1] = {0.0f};
};

TEST_F(EngineTest, LeavesAFrameWithoutBlocksOut) {
  Engine engine = makeEngine();
  EXPECT_EQ(engine.integrate(depthFrame()).status, FrameStatus::kNoMeasurement);
  EXPECT_EQ(engine.contents().frames, 0u);
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

}  // namespace
}  // namespace dtsdf
