// Projection into the image, against values worked out by hand.
#include "kernels/core/camera.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace camera_test {

/// Voxels of 0.1 m, a camera at voxel (1, 2, 3) that looks along z.
FrameView makeFrame() {
  FrameView frame{};
  frame.width = 64;
  frame.height = 48;
  frame.intrinsics = {100.0f, 50.0f, 30.0f, 20.0f};
  frame.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {1, 2, 3}};
  frame.voxel_size_m = 0.1f;
  return frame;
}

TEST(BackProject, IntegersAreTheCentresOfPixels) {
  const Vec3f ahead = backProject(makeFrame().intrinsics, 30.0f, 20.0f, 2.0f);
  EXPECT_EQ(ahead.x, 0.0f);
  EXPECT_EQ(ahead.y, 0.0f);
  EXPECT_EQ(ahead.z, 2.0f);
  const Vec3f beside = backProject(makeFrame().intrinsics, 80.0f, 45.0f, 2.0f);
  EXPECT_FLOAT_EQ(beside.x, 1.0f);
  EXPECT_FLOAT_EQ(beside.y, 1.0f);
}

/// Coordinates count from the corner of the first pixel: truncated, they are the pixel itself.
TEST(ProjectToImage, FallsOnTheMiddleOfThePixel) {
  const VoxelInImage ahead = projectToImage(makeFrame(), {1, 2, 13});
  EXPECT_FLOAT_EQ(ahead.depth_m, 1.0f);
  EXPECT_FLOAT_EQ(ahead.u, 30.5f);
  EXPECT_FLOAT_EQ(ahead.v, 20.5f);
  const VoxelInImage beside = projectToImage(makeFrame(), {3, 1, 23});  // (0.2, -0.1, 2) m
  EXPECT_FLOAT_EQ(beside.depth_m, 2.0f);
  EXPECT_FLOAT_EQ(beside.u, 40.5f);
  EXPECT_FLOAT_EQ(beside.v, 18.0f);
}

TEST(PixelIndex, CountsRowByRow) {
  EXPECT_EQ(pixelIndex(makeFrame(), {0, 0}), 0);
  EXPECT_EQ(pixelIndex(makeFrame(), {5, 3}), 3 * 64 + 5);
}

}  // namespace camera_test
}  // namespace dtsdf
