// Which points of surfaces an image can show.
#include "kernels/colour/surface_point.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace surface_point_test {

/// Farther away than a voxel, within the range, and on a pixel.
TEST(SurfacePoint, IsInTheImage) {
  PointView view{};
  view.frame.width = 64;
  view.frame.height = 48;
  view.frame.voxel_size_m = 0.02f;
  view.max_depth_m = 3.0f;
  const auto isSeen = [&](float depth_m, float u, float v) {
    return isInImage(view, {depth_m, -1.0f, u, v, {}});
  };
  for (const float depth_m : {0.021f, 1.0f, 3.0f}) EXPECT_TRUE(isSeen(depth_m, 30, 20)) << depth_m;
  for (const float depth_m : {-1.0f, 0.0f, 0.019f, 3.01f}) {
    EXPECT_FALSE(isSeen(depth_m, 30, 20)) << depth_m;
  }
  for (const float u : {0.0f, 63.9f}) EXPECT_TRUE(isSeen(1, u, 20)) << u;
  for (const float u : {-0.1f, 64.0f}) EXPECT_FALSE(isSeen(1, u, 20)) << u;
  for (const float v : {0.0f, 47.9f}) EXPECT_TRUE(isSeen(1, 30, v)) << v;
  for (const float v : {-0.1f, 48.0f}) EXPECT_FALSE(isSeen(1, 30, v)) << v;
}

}  // namespace surface_point_test
}  // namespace dtsdf
