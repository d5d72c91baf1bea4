#include "level/frame_points.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dtsdf {
namespace {

/// A wall at 2 m along the optical axis, with depths measured along each pixel's ray.
TEST(FramePoints, RayDepthBecomesAxialDepth) {
  constexpr int kWallWidth = 40, kWallHeight = 30;
  std::vector<float> along_rays, turned(kWallWidth * kWallHeight);
  DepthFrame frame;
  frame.intrinsics = {20.0f, 22.0f, 18.5f, 14.5f};
  for (int v = 0; v < kWallHeight; ++v) {
    for (int u = 0; u < kWallWidth; ++u) {
      const double x = (u - 18.5) / 20.0, y = (v - 14.5) / 22.0;
      along_rays.push_back(static_cast<float>(2000.0 * std::sqrt(x * x + y * y + 1.0)));
    }
  }
  along_rays[7] = std::nanf("");
  frame.data = along_rays.data();
  frame.width = kWallWidth;
  frame.height = kWallHeight;
  frame.row_bytes = kWallWidth * sizeof(float);
  frame.encoding = DepthEncoding::kFloat32;
  frame.unit_m = 0.001f;
  rayToAxialDepth(frame, turned.data());
  for (int i = 0; i < kWallWidth * kWallHeight; ++i) {
    const double z_m = depthAt(frame, i % kWallWidth, i / kWallWidth);
    EXPECT_NEAR(z_m, i == 7 ? 0.0 : 2.0, 1e-6) << i;
  }
}

}  // namespace
}  // namespace dtsdf
