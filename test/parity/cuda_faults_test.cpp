// Makes each CUDA call fail once while frames are fused, colour images are painted and a mesh is
// extracted. The mapper must recover, refuse blocks, drop the frame, or throw. After clear(), it
// must map as if nothing had happened.
#include <gtest/gtest.h>

#include <stdexcept>

#include "parity/backend_comparison.h"
#include "parity/test_frames.h"
#include "runtime/check.h"

namespace dtsdf {
namespace {

constexpr int kFrames = 3;

/// While in scope, makes the n-th CUDA call fail.
struct Failure {
  Failure(uint64_t n, cudaError_t code) { gpu::failCall(n, code); }
  ~Failure() { gpu::failCall(0, cudaSuccess); }
};

class CudaFaults : public testing::Test {
 protected:
  void SetUp() override {
    const std::string reason = reasonToSkip(Candidate::kCuda);
    if (!reason.empty()) GTEST_SKIP() << reason;
    TestFrameSettings settings;
    settings.count = kFrames;
    frames_ = makeTestFrames(settings);
    images_ = makeTestColours(settings);
    params_.map.voxel_size_m = 0.04f;
    params_.space.enabled = true;
  }

  /// What a run reports about a failure; empty if it reports none.
  std::string run(Mapper& mapper) const {
    try {
      for (int i = 0; i < kFrames; ++i) {
        for (const IntegrationResult& result :
             {mapper.integrate(frames_[i].view()), mapper.paint(images_[i].view())}) {
          if (result.status == FrameStatus::kNoMemory) return result.message;
          if (result.refused_blocks > 0) return "refused";
        }
      }
      mapper.updateMesh();
      mapper.space()->updateDistances();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  std::vector<TestFrame> frames_;
  std::vector<TestColours> images_;
  MapperParams params_;
};

TEST_F(CudaFaults, ClearRecoversFromOutOfMemory) {
  BackendPair pair(params_, Candidate::kCuda);
  int met = 0, refused = 0;
  // The mapper recovers from some failures without a report, so the loop ends only after 30 runs in
  // a row without a report. By then, each call has failed once.
  for (uint64_t n = 1, unreported = 0; unreported < 30; ++n) {
    SCOPED_TRACE("call " + std::to_string(n));
    pair.clear();
    {
      const Failure failure(n, cudaErrorMemoryAllocation);
      const std::string problem = run(pair.candidate());
      unreported = problem.empty() ? unreported + 1 : 0;
      met += !problem.empty();
      refused += problem == "refused";
    }
    if (n % 7 != 0) continue;  // comparing all would take hours
    pair.clear();
    for (int i = 0; i < kFrames; ++i) {
      ASSERT_NO_FATAL_FAILURE(pair.integrate(frames_[i].view()));
      ASSERT_NO_FATAL_FAILURE(pair.paint(images_[i].view()));
    }
    ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    ASSERT_NO_FATAL_FAILURE(pair.compareMaps());
    ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  }
  EXPECT_GT(met, 20);
  EXPECT_GT(refused, 0) << "some blocks should be refused for lack of memory";
}

/// Mapping continues as if the frame that ran out of memory had never arrived.
TEST_F(CudaFaults, AFrameWithoutMemoryLeavesNothingBehind) {
  BackendPair pair(params_, Candidate::kCuda);
  int compared = 0;
  for (uint64_t n = 1, unreported = 0; unreported < 30; ++n) {
    SCOPED_TRACE("call " + std::to_string(n));
    pair.clear();
    bool is_left_out = false, is_other = false;
    try {
      const Failure failure(n, cudaErrorMemoryAllocation);
      for (const TestFrame& frame : frames_) {
        const IntegrationResult result = pair.candidate().integrate(frame.view());
        const bool lacks_memory = result.status == FrameStatus::kNoMemory;
        is_left_out |= lacks_memory;
        is_other |= result.refused_blocks > 0 || (lacks_memory && !isAllocation(result.message));
        if (result.status == FrameStatus::kFused) pair.reference().integrate(frame.view());
      }
    } catch (const std::runtime_error&) {
      is_other = true;  // the mapper is unusable until clear()
    }
    unreported = is_left_out || is_other ? 0 : unreported + 1;
    if (!is_left_out || is_other) continue;
    ++compared;
    ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    ASSERT_NO_FATAL_FAILURE(pair.compareMaps());
    ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  }
  EXPECT_GT(compared, 0);
}

TEST_F(CudaFaults, ReportsALostGpu) {
  BackendPair pair(params_, Candidate::kCuda);
  ASSERT_EQ(run(pair.candidate()), "");
  const Failure failure(1, cudaErrorIllegalAddress);
  for (int i = 0; i < 2; ++i) {
    const std::string problem = run(pair.candidate());
    EXPECT_NE(problem.find("restart the node"), std::string::npos) << problem;
  }
}

}  // namespace
}  // namespace dtsdf
