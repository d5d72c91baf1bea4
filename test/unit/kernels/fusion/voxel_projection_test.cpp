// Projecting voxels into an image whose every pixel is known.
#include "kernels/fusion/voxel_projection.h"

#include <gtest/gtest.h>

#include <vector>

namespace dtsdf {
namespace voxel_projection_test {

/// A camera on the z axis of an unturned local frame, looking along z; one voxel is 0.1 m.
FrameView frontalView() {
  FrameView frame{};
  frame.width = frame.height = 9;
  frame.intrinsics = {10.0f, 10.0f, 4.0f, 4.0f};
  frame.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.0f, 0.0f, 0.0f}};
  frame.voxel_size_m = 0.1f;
  return frame;
}

TEST(ProjectVoxel, TakesTheDistanceAlongTheOpticalAxis) {
  const FrameView frame = frontalView();
  const FusionSettings fusion{0, 1, 4.0f, 64.0f, FusionRules()};
  const std::vector<Surfel> surfels(81, Surfel{{0, 0, 0}, 0.5f, {0.0f, 0.0f, -1.0f}, 1.0f});
  for (int z = 1; z <= 20; ++z) {
    int calls = 0;
    auto add = [&](int direction, int32_t weight, int32_t sdf, uint32_t) {
      ++calls;
      EXPECT_EQ(direction, 5);
      EXPECT_EQ(weight, quantiseWeight(0.5f));
      EXPECT_NEAR(sdf, quantiseSdf((10.0f - static_cast<float>(z)) / 4.0f), 1);
    };
    projectVoxel(frame, fusion, surfels.data(), {0, 0, z}, add);
    EXPECT_EQ(calls, z <= 14 ? 1 : 0) << "voxel at " << z;  // nothing beyond the truncation
  }
}

TEST(ProjectVoxel, LeavesOutWhatTheCameraDoesNotSee) {
  const FrameView frame = frontalView();
  const FusionSettings fusion{0, 1, 4.0f, 64.0f, FusionRules()};
  std::vector<Surfel> surfels(81, Surfel{{0, 0, 0}, 0.5f, {0.0f, 0.0f, -1.0f}, 1.0f});
  surfels[4 * 9 + 4].weight = 0.0f;
  auto add = [](int, int32_t, int32_t, uint32_t) { ADD_FAILURE() << "a voxel that is not seen"; };
  // Behind, in the camera's plane, on a pixel without measurement, and outside the image.
  for (const Vec3i& voxel : {Vec3i{0, 0, -9}, Vec3i{3, 0, 0}, Vec3i{0, 0, 9}, Vec3i{5, 0, 9},
                             Vec3i{-5, 0, 9}, Vec3i{0, 5, 9}, Vec3i{0, -5, 9}}) {
    projectVoxel(frame, fusion, surfels.data(), voxel, add);
  }
}

}  // namespace voxel_projection_test
}  // namespace dtsdf
