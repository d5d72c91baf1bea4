// Tests which pixels are subdivided, and where their subpixels lie, on analytic planes and steps.
#include "kernels/surfels/pixel_subdivision.h"

#include <gtest/gtest.h>

#include <vector>

#include "kernels/surfels/surfel.h"
#include "support/surface_image.h"

namespace dtsdf {
namespace pixel_subdivision_test {

constexpr int kWidth = 64, kHeight = 48;
constexpr Intrinsics kIntrinsics{500.0f, 500.0f, 31.5f, 23.5f};
const SurfelSettings kSurfels{5, 0.03f, SurfelRules(), 0};
constexpr int kMiddleU = 30, kMiddleV = 24;

class SubdividedImage {
 public:
  SubdividedImage(const Surface& surface, float voxel_m)
      : image_(surface, frontalFrame(kWidth, kHeight, kIntrinsics, voxel_m), kSurfels) {}

  PixelMeasurement pixelAt(int u, int v) const {
    const FrameSensing sensing = image_.sensing();
    return subdividedPixel(sensing, {u, v}, fitColumn(sensing, {u, v}, kSurfels), kSurfels);
  }
  Subdivision subdivisionAt(int u, int v) const { return pixelAt(u, v).subdivision; }

  std::vector<Surfel> subpixelsAt(int u, int v) const {
    const PixelMeasurement pixel = pixelAt(u, v);
    std::vector<Surfel> surfels;
    for (int i = 0; i < subpixelCount(pixel.subdivision); ++i) {
      surfels.push_back(makeSubpixelSurfel(image_.sensing().image, pixel, i));
    }
    return surfels;
  }

  Surfel wholeAt(int u, int v) const { return makePixelSurfel(image_.sensing(), {u, v}, kSurfels); }

 private:
  SurfaceImage image_;
};

/// Subpixels lie on the plane, evenly distributed over the pixel. Their total weight is that of the
/// whole pixel.
TEST(PixelSubdivision, KeepsPlaneAndWeight) {
  const double n[3] = {0.4, -0.7, 1.0}, delta = 2.0;
  const float voxel_m = 0.002f;
  const SubdividedImage image(plane(n[0], n[1], n[2], delta), voxel_m);
  for (int v = 5; v < kHeight - 5; ++v) {
    for (int u = 5; u < kWidth - 5; ++u) {
      const std::vector<Surfel> parts = image.subpixelsAt(u, v);
      const Surfel whole = image.wholeAt(u, v);
      ASSERT_EQ(parts.size(), 9u);
      double weight = 0.0, mean_u = 0.0, mean_v = 0.0;
      for (const Surfel& part : parts) {
        weight += part.weight;
        mean_u += kIntrinsics.fx * part.p_L.x / part.p_L.z + kIntrinsics.cx;
        mean_v += kIntrinsics.fy * part.p_L.y / part.p_L.z + kIntrinsics.cy;
        const double off =
            voxel_m * (n[0] * part.p_L.x + n[1] * part.p_L.y + n[2] * part.p_L.z) - delta;
        EXPECT_NEAR(off, 0.0, 5e-6);
      }
      // Unlike the subpixels' weights, the weight of a whole pixel does not include its footprint.
      const double width = whole.depth_m / (kIntrinsics.fx * voxel_m);
      const double expected = width * width * whole.weight;
      EXPECT_NEAR(weight, expected, 0.01 * expected);
      EXPECT_NEAR(mean_u / 9.0, u, 1e-3);
      EXPECT_NEAR(mean_v / 9.0, v, 1e-3);
    }
  }
}

/// No subpixels are inserted across a step or a hole.
TEST(PixelSubdivision, StopsAtStepsAndHoles) {
  const double x_edge = (kMiddleU + 0.5 - kIntrinsics.cx) / kIntrinsics.fx;
  for (const double beyond_m : {2.03, 2.5, 0.0}) {
    const SubdividedImage image([&](double x, double) { return x < x_edge ? 2.0 : beyond_m; },
                                0.003f);
    EXPECT_EQ(image.subdivisionAt(kMiddleU, kMiddleV).across, 1) << beyond_m;
    EXPECT_EQ(image.subdivisionAt(kMiddleU, kMiddleV).half_across_px, 0.0f) << beyond_m;
    EXPECT_EQ(image.subdivisionAt(kMiddleU, kMiddleV).down, 3) << beyond_m;
    EXPECT_EQ(image.subdivisionAt(kMiddleU - 6, kMiddleV).across, 3) << beyond_m;
  }
}

}  // namespace pixel_subdivision_test
}  // namespace dtsdf
