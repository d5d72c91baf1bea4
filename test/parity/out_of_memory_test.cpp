// Tests what happens if the GPU runs out of memory. Blocks are refused, like blocks beyond the
// budget, or the frame is dropped completely. The map is kept, and mapping continues. The test
// fills the GPU's memory, so it runs only if DTSDF_TEST_OUT_OF_MEMORY is set.
#include <gtest/gtest.h>

#include <cstdlib>
#include <stdexcept>

#include "parity/backend_comparison.h"
#include "parity/test_frames.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace {

/// Allocates the device's free memory in ever smaller pieces, down to 64 KiB.
std::vector<gpu::DeviceBuffer<char>> takeDeviceMemory() {
  std::vector<gpu::DeviceBuffer<char>> pieces;
  for (size_t bytes = size_t(1) << 36; bytes >= (size_t(1) << 16); bytes /= 2) {
    try {
      while (true) pieces.emplace_back(bytes);
    } catch (const BackendError& error) {
      EXPECT_TRUE(error.isOutOfMemory());
    }
  }
  return pieces;
}

TEST(OutOfDeviceMemory, BlocksAreRefusedAndTheMapStays) {
  if (std::getenv("DTSDF_TEST_OUT_OF_MEMORY") == nullptr) {
    GTEST_SKIP() << "DTSDF_TEST_OUT_OF_MEMORY is not set";
  }
  const std::string reason = reasonToSkip(Candidate::kCuda);
  if (!reason.empty()) GTEST_SKIP() << reason;

  TestFrameSettings settings;
  settings.width = 640;
  settings.height = 480;
  settings.count = 3;
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  MapperParams params;
  params.map.voxel_size_m = 0.01f;
  BackendPair pair(params, Candidate::kCuda);
  ASSERT_NO_FATAL_FAILURE(pair.integrate(frames[0].view()));
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  {
    const std::vector<gpu::DeviceBuffer<char>> taken = takeDeviceMemory();
    bool failed = false;
    for (int i = 0; i < 4 && !failed; ++i) {  // the remaining memory may suffice for a frame or two
      DepthFrame elsewhere = frames[1].view();
      elsewhere.T_W_C.pretranslate(Eigen::Vector3d(50.0 * (i + 1), 0.0, 0.0));
      pair.candidate().outline();  // brings the stats up to date
      const MapStats before = pair.candidate().stats();
      const IntegrationResult result = pair.candidate().integrate(elsewhere);
      failed = result.status == FrameStatus::kNoMemory || result.refused_blocks > 0;
      if (!failed) {
        pair.reference().integrate(elsewhere);
        continue;
      }
      EXPECT_EQ(pair.candidate().stats().blocks, before.blocks);
    }
    EXPECT_TRUE(failed);
    expectEqualMaps(pair.reference(), pair.candidate());
    EXPECT_NO_THROW(pair.candidate().integrate(frames[0].view())) << "mapping should continue";
  }
  // The candidate may have counted a frame that the reference lacks, so both maps are cleared.
  ASSERT_NO_FATAL_FAILURE(pair.clear());
  ASSERT_NO_FATAL_FAILURE(pair.integrate(frames[2].view()));
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  pair.compareMaps();
}

}  // namespace
}  // namespace dtsdf
