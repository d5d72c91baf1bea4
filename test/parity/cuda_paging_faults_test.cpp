// Makes each allocation fail once during a frame that pages blocks out and in. If that frame is not
// fused, it must leave the map unchanged, and mapping must continue from there.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "parity/backend_comparison.h"
#include "parity/test_frames.h"
#include "runtime/check.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

/// Checks that the keys are in ascending order, without duplicates.
void expectAscendingKeys(const MapContents& contents) {
  for (size_t i = 1; i < contents.blocks.size(); ++i) {
    ASSERT_LT(packKey(contents.blocks[i - 1].key), packKey(contents.blocks[i].key));
  }
}

class CudaPagingFaults : public testing::Test {
 protected:
  static constexpr int kMaxCalls = 2000;

  void SetUp() override {
    const std::string reason = reasonToSkip(Candidate::kCuda);
    if (!reason.empty()) GTEST_SKIP() << reason;
    for (int room = 0; room < 2; ++room) {
      TestFrameSettings settings;
      settings.count = 1;
      settings.offset_W = {6.0 * room, -3.0 * room, 0.0};
      rooms_.push_back(makeTestFrames(settings)[0]);
      settings.width *= 2;
      settings.height *= 2;
      large_.push_back(makeTestFrames(settings)[0]);
    }
    params_.backend = Backend::kCuda;
    params_.map.voxel_size_m = 0.04f;
    params_.map.max_memory_mb = 3;
    params_.map.page_folder = folder_.path();
    params_.map.page_max_gb = 1.0f;
    params_.fusion.max_depth_m = 4.0f;
  }

  /// Fuses a frame of each of these rooms, with a mesh update after the first.
  void fuse(Mapper& mapper, const std::vector<size_t>& rooms) const {
    for (size_t i = 0; i < rooms.size(); ++i) {
      ASSERT_EQ(mapper.integrate(rooms_[rooms[i]].view()).status, FrameStatus::kFused);
      if (i == 0) mapper.updateMesh();
    }
  }

  static IntegrationResult integrateFailing(Mapper& mapper, const TestFrame& frame, uint64_t call) {
    gpu::failCall(call, cudaErrorMemoryAllocation);
    const IntegrationResult result = mapper.integrate(frame.view());
    gpu::failCall(0, cudaSuccess);
    return result;
  }

  /// Fuses the rooms `before`, then makes each CUDA call of the next frame fail in turn. If an
  /// allocation failed and the frame was not fused, compares the maps with those of a run without
  /// failures.
  void compare(const std::vector<size_t>& before, size_t room, const std::vector<size_t>& after) {
    const auto mapper = makeProbedMapper(params_);
    ASSERT_NO_FATAL_FAILURE(fuse(*mapper, before));
    const MapContents untouched = mapper->contents();
    ASSERT_GT(mapper->stats().pages.written, 0u) << "blocks should have been paged out";
    ASSERT_NO_FATAL_FAILURE(fuseRest(*mapper, room, after));
    const MapContents whole = mapper->contents();
    int compared = 0;
    for (uint64_t call = 1, unmet = 0; unmet < 10 && call < kMaxCalls; ++call) {
      SCOPED_TRACE("call " + std::to_string(call));
      mapper->clear();
      ASSERT_NO_FATAL_FAILURE(fuse(*mapper, before));
      const IntegrationResult result = integrateFailing(*mapper, large_[room], call);
      const bool is_fused = result.status == FrameStatus::kFused;
      unmet = is_fused && result.refused_blocks == 0 ? unmet + 1 : 0;
      if (is_fused || !isAllocation(result.message)) continue;
      ++compared;
      const MapContents contents = mapper->contents();
      ASSERT_NO_FATAL_FAILURE(expectAscendingKeys(contents));
      ASSERT_NO_FATAL_FAILURE(expectEqualContents(untouched, contents));
      ASSERT_NO_FATAL_FAILURE(fuseRest(*mapper, room, after));
      ASSERT_NO_FATAL_FAILURE(expectEqualContents(whole, mapper->contents()));
    }
    EXPECT_GT(compared, 0);
  }

  /// Fuses the large frame of `room`, then the frames of the rooms `after`.
  void fuseRest(Mapper& mapper, size_t room, const std::vector<size_t>& after) const {
    ASSERT_EQ(mapper.integrate(large_[room].view()).status, FrameStatus::kFused);
    ASSERT_NO_FATAL_FAILURE(fuse(mapper, after));
  }

  TemporaryFolder folder_;
  std::vector<TestFrame> rooms_;
  std::vector<TestFrame> large_;  ///< Larger frames of the same rooms, which need more memory.
  MapperParams params_;
};

TEST_F(CudaPagingFaults, AFailedFrameLeavesTheMapUnchanged) { compare({0, 1}, 0, {1, 0}); }

}  // namespace
}  // namespace dtsdf
