// The weight and the place of a surfel, against values worked out by hand.
#include "kernels/surfels/surfel.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dtsdf {
namespace surfel_test {

/// A pixel of 1/500 at 2 m is 4 mm wide: of voxels of 20 mm it covers a fifth by a fifth.
TEST(CoveredShare, IsThatOfAFaceOfAVoxel) {
  FrameView frame{};
  frame.intrinsics = {500.0f, 500.0f, 320.0f, 240.0f};
  frame.voxel_size_m = 0.02f;
  EXPECT_FLOAT_EQ(coveredShare(frame, 2.0f), 0.04f);
  EXPECT_FLOAT_EQ(coveredShare(frame, 4.0f), 0.16f);
}

TEST(AngleWeight, IsTheCosineToTheViewRay) {
  EXPECT_FLOAT_EQ(angleWeight({0, 0, 2}, {0, 0, -1}), 1.0f);
  EXPECT_FLOAT_EQ(angleWeight({0, 0, 2}, {0, 0.8f, -0.6f}), 0.6f);
  EXPECT_FLOAT_EQ(angleWeight({3, 0, 4}, {0, 0, -1}), 0.8f);  // a frontal wall, seen from aside
  EXPECT_FLOAT_EQ(angleWeight({3, 0, 4}, {-0.6f, 0, -0.8f}), 1.0f);
  EXPECT_EQ(angleWeight({0, 0, 2}, {1, 0, 0}), 0.0f);
  EXPECT_EQ(angleWeight({0, 0, 2}, {0, 0, 1}), 0.0f);  // from behind
  EXPECT_EQ(angleWeight({0, 0, 2}, {0, 0.8f, 0.6f}), 0.0f);
}

/// A camera turned by 90 degrees about its x axis, at voxel (1, 2, 3); voxels of 0.5 m.
FrameView turnedFrame() {
  FrameView frame{};
  frame.intrinsics = {500.0f, 400.0f, 320.0f, 240.0f};
  frame.T_L_C = {{1, 0, 0, 0, 0, -1, 0, 1, 0}, {1, 2, 3}};
  frame.voxel_size_m = 0.5f;
  return frame;
}

/// At 2 m, 250 pixels right of the centre: (1, 0, 2) m, seen with a cosine of 2 / sqrt(5).
TEST(Surfel, StandsWhereItsPixelsAre) {
  const Surfel surfel = makeSurfel(turnedFrame(), {{570.0f, 240.0f, 2.0f}, {0, 0, -1}, 0.5f});
  EXPECT_FLOAT_EQ(surfel.p_L.x, 1.0f + 2.0f);
  EXPECT_FLOAT_EQ(surfel.p_L.y, 2.0f - 4.0f);
  EXPECT_FLOAT_EQ(surfel.p_L.z, 3.0f);
  EXPECT_FLOAT_EQ(surfel.normal_L.y, 1.0f);
  EXPECT_FLOAT_EQ(surfel.weight, 1.0f / std::sqrt(5.0f));
  EXPECT_EQ(surfel.depth_m, 2.0f);
}

TEST(Surfel, WithoutANormalIsNone) {
  const ImagePoint centre{320.0f, 240.0f, 2.0f};
  EXPECT_EQ(makeSurfel(turnedFrame(), {centre, {0, 0, 0}, 1.0f}).weight, 0.0f);
}

}  // namespace surfel_test
}  // namespace dtsdf
