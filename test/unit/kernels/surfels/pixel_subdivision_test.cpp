// Which pixels are subdivided, and where their subpixels lie, on analytic planes and steps.
#include "kernels/surfels/pixel_subdivision.h"

#include <gtest/gtest.h>

#include <cmath>
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

/// At 2 m a pixel is 4 mm wide.
TEST(PixelSubdivision, AreThirdsOfPixelsWiderThanAVoxel) {
  for (const auto& [voxel_m, count] :
       {std::pair<float, int>{0.005f, 1}, {0.0041f, 1}, {0.0039f, 3}, {0.0001f, 3}}) {
    const Subdivision parts =
        SubdividedImage(plane(0, 0, 1, 2), voxel_m).subdivisionAt(kMiddleU, kMiddleV);
    EXPECT_EQ(parts.across, count) << voxel_m;
    EXPECT_EQ(parts.down, count) << voxel_m;
  }
}

/// But not where their centres are within half a voxel.
TEST(PixelSubdivision, GoesOnHalfwayToTheNext) {
  for (const auto& [voxel_m, half_px] : {std::pair<float, float>{0.0081f, 0.0f},
                                         {0.0079f, 0.5f},
                                         {0.0041f, 0.5f},
                                         {0.0039f, 1.0f / 6.0f}}) {
    const std::vector<Surfel> parts =
        SubdividedImage(plane(0, 0, 1, 2), voxel_m).subpixelsAt(kMiddleU, kMiddleV);
    EXPECT_FLOAT_EQ(parts[0].footprint_px.across, half_px) << voxel_m;
    EXPECT_FLOAT_EQ(parts[0].footprint_px.down, half_px) << voxel_m;
  }
}

/// A wall at 2 m that the camera looks along: 4 mm are 4 mm up the wall, but 12 mm along it.
TEST(PixelSubdivision, FollowTheSlant) {
  const double slant = std::acos(1.0 / 3.0);
  const Surface across = plane(std::sin(slant), 0, std::cos(slant), 2.0 * std::cos(slant));
  const Surface down = plane(0, std::sin(slant), std::cos(slant), 2.0 * std::cos(slant));
  const Subdivision wall = SubdividedImage(across, 0.005f).subdivisionAt(kMiddleU, kMiddleV);
  EXPECT_EQ(wall.across, 3);
  EXPECT_EQ(wall.down, 1);
  const Subdivision floor = SubdividedImage(down, 0.005f).subdivisionAt(kMiddleU, kMiddleV);
  EXPECT_EQ(floor.across, 1);
  EXPECT_EQ(floor.down, 3);
}

/// The subpixels lie on the plane, evenly over the pixel, and together weigh what the whole does.
TEST(PixelSubdivision, ShareOutPlaneAndWeight) {
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
      // A whole one has no share: voxels that look up their pixel take one each.
      const double width = whole.depth_m / (kIntrinsics.fx * voxel_m);
      const double expected = width * width * whole.weight;
      EXPECT_NEAR(weight, expected, 0.01 * expected);
      EXPECT_NEAR(mean_u / 9.0, u, 1e-3);
      EXPECT_NEAR(mean_v / 9.0, v, 1e-3);
    }
  }
}

/// Beside a step, and beside a hole, nothing is put in between: no subpixel across.
TEST(PixelSubdivision, StopAtStepsAndHoles) {
  const double x_edge = (kMiddleU + 0.5 - kIntrinsics.cx) / kIntrinsics.fx;
  for (const double beyond_m : {2.03, 2.5, 0.0}) {
    const SubdividedImage image([&](double x, double) { return x < x_edge ? 2.0 : beyond_m; },
                                0.003f);
    EXPECT_EQ(image.subdivisionAt(kMiddleU, kMiddleV).across, 1) << beyond_m;
    EXPECT_EQ(image.subdivisionAt(kMiddleU, kMiddleV).footprint_px.across, 0.0f) << beyond_m;
    EXPECT_EQ(image.subdivisionAt(kMiddleU, kMiddleV).down, 3) << beyond_m;
    EXPECT_EQ(image.subdivisionAt(kMiddleU - 6, kMiddleV).across, 3) << beyond_m;
  }
}

/// A box whose top shows as a single row, and a wall far behind it: nothing hangs between the two.
/// Rows at such steps that do go on are one surface.
TEST(PixelSubdivision, NeedTheStepOfTheirPlane) {
  const auto rowOf = [](double y) { return std::lround(y * kIntrinsics.fy + kIntrinsics.cy); };
  const SubdividedImage top(
      [&](double, double y) {
        const auto below = rowOf(y) - kMiddleV;
        return below > 1 ? 3.07 : below == 1 ? 3.5 : 4.67;
      },
      0.025f);
  EXPECT_EQ(top.subdivisionAt(kMiddleU, kMiddleV).down, 1);
  const SubdividedImage floor(
      [&](double, double y) {
        return 1.0 / (0.25 + 0.02 * static_cast<double>(rowOf(y) - kMiddleV));
      },
      0.025f);
  EXPECT_EQ(floor.subdivisionAt(kMiddleU, kMiddleV).down, 3);
}

/// At the border of the image there is no neighbour to tell; no read goes beyond it.
TEST(PixelSubdivision, NeedBothNeighbours) {
  const SubdividedImage image(plane(0, 0, 1, 2), 0.003f);
  for (const int u : {0, kWidth - 1}) {
    EXPECT_EQ(image.subdivisionAt(u, kMiddleV).across, 1);
    EXPECT_EQ(image.subdivisionAt(u, kMiddleV).down, 3);
  }
  for (const int v : {0, kHeight - 1}) {
    EXPECT_EQ(image.subdivisionAt(kMiddleU, v).across, 3);
    EXPECT_EQ(image.subdivisionAt(kMiddleU, v).down, 1);
  }
}

/// Whatever plane noise makes up, no subpixel is farther away than what was measured beside it.
TEST(PixelSubdivision, LieNoFartherThanTheMeasurements) {
  const float inverse_depth[9] = {0.5f, 0.5f, 0.5f, 0.4f, 0.5f, 0.5f, 0.5f, 0.45f, 0.5f};
  const ImageView image{frontalFrame(3, 3, kIntrinsics, 0.01f), inverse_depth, nullptr, nullptr,
                        nullptr};
  const PixelPlane steep{{0.0f, 0.0f, -1.0f}, 3.0f, -2.0f, 1.0f};
  EXPECT_EQ(inverseDepthBeside(image, {1, 1}, steep, {-0.4f, 0.0f}), 0.4f);
  EXPECT_EQ(inverseDepthBeside(image, {1, 1}, steep, {0.0f, 0.4f}), 0.45f);
  EXPECT_EQ(inverseDepthBeside(image, {1, 1}, steep, {-0.4f, 0.4f}), 0.4f);
  EXPECT_EQ(inverseDepthBeside(image, {1, 1}, steep, {0.0f, 0.0f}), 0.5f);
}

}  // namespace pixel_subdivision_test
}  // namespace dtsdf
