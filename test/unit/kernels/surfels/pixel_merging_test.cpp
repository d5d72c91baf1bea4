// Tests which pixels are merged, and the resulting surfels, on analytic planes and steps.
#include "kernels/surfels/pixel_merging.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/surfels/surfel.h"
#include "support/surface_image.h"

namespace dtsdf {
namespace pixel_merging_test {

constexpr int kWidth = 64, kHeight = 48;
constexpr Intrinsics kIntrinsics{500.0f, 500.0f, 31.5f, 23.5f};
const SurfelSettings kSurfels{5, 0.03f, SurfelRules(), 0};

/// An image of a surface with its merged pixels.
class MergedImage {
 public:
  MergedImage(const Surface& surface, float voxel_m)
      : image_(surface, frontalFrame(kWidth, kHeight, kIntrinsics, voxel_m), kSurfels) {}

  /// Side length of the square that contains the pixel.
  int sideAt(int u, int v) const {
    const MergedPatch patch = patchAt(u, v);
    if (patch >> kPatchBit & 1) return kPatchSide;
    const int quad = (u & 3) / 2 + 2 * ((v & 3) / 2);
    return patch >> quad & 1 ? kQuadSide : 1;
  }

  /// The surfel of the square whose first pixel is (u, v); noSurfel() at all other pixels.
  Surfel surfelAt(int u, int v) const {
    const int side = mergedSide(patchAt(u, v), {u, v});
    if (side == 0) return noSurfel();
    return side == 1 ? makePixelSurfel(image_.sensing(), {u, v}, kSurfels)
                     : makeMergedSurfel(image_.sensing(), {{u, v}, side}, kSurfels);
  }

 private:
  MergedPatch patchAt(int u, int v) const {
    return mergePatch(image_.sensing().image, {u - u % kPatchSide, v - v % kPatchSide}, kSurfels);
  }

  SurfaceImage image_;
};

/// The surfel of a square lies on the plane at the square's centre and has the plane's normal. Its
/// weight is the sum of the pixels' weights.
TEST(PixelMerging, KeepsPlaneAndWeight) {
  const double n[3] = {0.3, -0.2, 1.0}, length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const double delta = 2.0;
  const Surface surface = plane(n[0], n[1], n[2], delta);
  const MergedImage single(surface, 0.005f);
  double single_weight = 0.0;
  for (int v = 4; v < kHeight - 4; ++v) {
    for (int u = 4; u < kWidth - 4; ++u) {
      const Surfel surfel = single.surfelAt(u, v);
      // The weight of a single pixel does not include its footprint.
      single_weight += surfel.weight * surfel.depth_m * surfel.depth_m;
    }
  }
  for (const float voxel_m : {0.02f, 0.05f}) {
    const MergedImage image(surface, voxel_m);
    double weight = 0.0;
    int count = 0;
    for (int v = 4; v < kHeight - 4; ++v) {
      for (int u = 4; u < kWidth - 4; ++u) {
        const Surfel surfel = image.surfelAt(u, v);
        if (!(surfel.weight > 0.0f)) continue;
        ++count;
        weight += surfel.weight;
        const double off =
            voxel_m * (n[0] * surfel.p_L.x + n[1] * surfel.p_L.y + n[2] * surfel.p_L.z) - delta;
        EXPECT_NEAR(off, 0.0, 2e-6);
        EXPECT_NEAR(surfel.normal_L.x, -n[0] / length, 2e-4);
        EXPECT_NEAR(surfel.normal_L.y, -n[1] / length, 2e-4);
        EXPECT_NEAR(surfel.normal_L.z, -n[2] / length, 2e-4);
      }
    }
    const int side = voxel_m > 0.03f ? 4 : 2;
    EXPECT_EQ(count, (kWidth - 8) * (kHeight - 8) / (side * side));
    const double voxel_px_m = kIntrinsics.fx * voxel_m;  // width in pixels of a voxel at 1 m
    const double expected = single_weight / (voxel_px_m * voxel_px_m);
    EXPECT_NEAR(weight, expected, 1e-3 * expected);
  }
}

/// A step in depth runs through squares of 4 x 4 and 2 x 2 pixels. If the step is deeper than a
/// voxel, squares across it or next to it are not merged, but all others are.
TEST(PixelMerging, DoesNotSpanAStep) {
  const int edge = 27;  // first column on the far side
  const double x_edge = (edge - 0.5 - kIntrinsics.cx) / kIntrinsics.fx;
  for (const double far_m : {1.019, 1.021, 1.045, 1.3}) {
    const MergedImage image([&](double x, double) { return x < x_edge ? 1.0 : far_m; }, 0.02f);
    for (int v = 8; v < kHeight - 8; ++v) {
      for (const int u : {25, 26, 27}) {
        EXPECT_EQ(image.sideAt(u, v), far_m < 1.02 ? 4 : 1) << far_m << ", " << u;
      }
      EXPECT_EQ(image.sideAt(8, v), 4) << far_m;
      EXPECT_EQ(image.sideAt(48, v), far_m < 1.1 ? 4 : 2) << far_m;
    }
  }
}

}  // namespace pixel_merging_test
}  // namespace dtsdf
