// Which pixels are merged, and what surfel they give, on analytic planes, steps and creases.
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

/// An image of a surface, and what is merged in it.
class MergedImage {
 public:
  MergedImage(const Surface& surface, float voxel_m)
      : image_(surface, frontalFrame(kWidth, kHeight, kIntrinsics, voxel_m), kSurfels) {}

  /// Side of the square that a pixel belongs to.
  int sideAt(int u, int v) const {
    const MergedPatch patch = patchAt(u, v);
    if (patch >> kPatchBit & 1) return kPatchSide;
    const int quad = (u & 3) / 2 + 2 * ((v & 3) / 2);
    return patch >> quad & 1 ? kQuadSide : 1;
  }

  /// The surfel of the square that the pixel is the first of.
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

bool nearBorder(int u, int v) {
  return u < kPatchSide || u >= kWidth - kPatchSide || v < kPatchSide || v >= kHeight - kPatchSide;
}

/// At 2 m a pixel is 4 mm wide: 2 are 0.4 voxels of 20 mm, 4 are 0.32 voxels of 50 mm.
TEST(PixelMerging, GrowsWithTheVoxel) {
  for (const auto& [voxel_m, side] : {std::pair<float, int>{0.005f, 1},
                                      {0.01f, 1},
                                      {0.02f, 2},
                                      {0.03f, 2},
                                      {0.05f, 4},
                                      {0.1f, 4}}) {
    const MergedImage image(plane(0.1, -0.2, 1.0, 2.0), voxel_m);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        if (nearBorder(u, v)) continue;
        EXPECT_EQ(image.sideAt(u, v), side) << u << " " << v << " " << voxel_m;
      }
    }
  }
}

/// The point lies on the plane at the square's centre, with the plane's normal; the weights of the
/// squares add up to those of the pixels.
TEST(PixelMerging, KeepsPlaneAndWeight) {
  const double n[3] = {0.3, -0.2, 1.0}, length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const double delta = 2.0;
  const Surface surface = plane(n[0], n[1], n[2], delta);
  const MergedImage single(surface, 0.005f);
  double single_weight = 0.0;
  for (int v = 4; v < kHeight - 4; ++v) {
    for (int u = 4; u < kWidth - 4; ++u) {
      const Surfel surfel = single.surfelAt(u, v);
      single_weight += surfel.weight * surfel.depth_m * surfel.depth_m;  // without its share
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
    const double voxel_px_m = kIntrinsics.fx * voxel_m;  // in pixels at 1 m
    const double expected = single_weight / (voxel_px_m * voxel_px_m);
    EXPECT_NEAR(weight, expected, 1e-3 * expected);
  }
}

/// The first point of a square of 2 x 2 stands for its four pixels, in their middle.
TEST(PixelMerging, LiesAtTheCentre) {
  const MergedImage image(plane(0.0, 0.0, 1.0, 2.0), 0.02f);
  const Surfel surfel = image.surfelAt(20, 12);
  const double per_px = 2.0 / kIntrinsics.fx / 0.02;
  EXPECT_NEAR(surfel.p_L.x, (20.5 - kIntrinsics.cx) * per_px, 1e-5);
  EXPECT_NEAR(surfel.p_L.y, (12.5 - kIntrinsics.cy) * per_px, 1e-5);
  EXPECT_NEAR(surfel.p_L.z, 100.0, 1e-4);
  EXPECT_EQ(image.surfelAt(21, 12).weight, 0.0f);
  EXPECT_EQ(image.surfelAt(21, 13).weight, 0.0f);
}

/// A step that runs through patches and quads, smaller and larger than the limit of the jump: what
/// lies across it is not merged, what does not reach it is.
TEST(PixelMerging, DoesNotSpanAStep) {
  const int edge = 27;  // first column on the far side
  const double x_edge = (edge - 0.5 - kIntrinsics.cx) / kIntrinsics.fx;
  for (const double far_m : {1.045, 1.3}) {
    const MergedImage image([&](double x, double) { return x < x_edge ? 1.0 : far_m; }, 0.02f);
    for (int v = 8; v < kHeight - 8; ++v) {
      EXPECT_EQ(image.sideAt(26, v), 1) << far_m;
      EXPECT_EQ(image.sideAt(27, v), 1) << far_m;
      EXPECT_EQ(image.sideAt(8, v), 4) << far_m;
      EXPECT_EQ(image.sideAt(48, v), far_m < 1.1 ? 4 : 2) << far_m;
    }
  }
}

TEST(PixelMerging, NeedsAllPixels) {
  const MergedImage image(
      [&](double x, double y) {
        const bool hole = std::abs(x * kIntrinsics.fx + kIntrinsics.cx - 22) < 0.5 &&
                          std::abs(y * kIntrinsics.fy + kIntrinsics.cy - 21) < 0.5;
        return hole ? 0.0 : 1.0;
      },
      0.05f);
  EXPECT_EQ(image.sideAt(22, 21), 1);
  EXPECT_EQ(image.surfelAt(22, 21).weight, 0.0f);
  EXPECT_EQ(image.sideAt(20, 21), 2);
  EXPECT_EQ(image.sideAt(40, 32), 4);
}

/// Two walls that meet at a right angle, across and along the rows, in front of the camera and
/// behind: pixels at the crease keep their own normals.
TEST(PixelMerging, LeavesCreasesAlone) {
  for (const bool across : {true, false}) {
    for (const double sign : {1.0, -1.0}) {
      const MergedImage image(
          [&](double x, double y) {
            const double t = sign * std::abs(across ? x : y);  // z = 2 + t z
            return 2.0 / (1.0 - t);
          },
          0.05f);
      for (int i = 12; i < 36; ++i) {
        const int at = across ? 31 : 23;  // the crease lies between at and at + 1
        EXPECT_LT(across ? image.sideAt(at, i) : image.sideAt(i, at), 4);
        EXPECT_LT(across ? image.sideAt(at + 1, i) : image.sideAt(i, at + 1), 4);
        EXPECT_EQ(across ? image.sideAt(8, i) : image.sideAt(i, 8), 4);
      }
    }
  }
}

/// Every pixel of an image of any size is in exactly one square, borders included.
TEST(PixelMerging, CoversEachPixelOnce) {
  for (MergedPatch patch : {0u, 1u, 6u, 9u, 15u, 16u}) {
    int covered = 0;
    for (int v = 0; v < kPatchSide; ++v) {
      for (int u = 0; u < kPatchSide; ++u) {
        const int side = mergedSide(patch, {u, v});
        covered += side * side;
      }
    }
    EXPECT_EQ(covered, kPatchSide * kPatchSide) << patch;
  }
}

}  // namespace pixel_merging_test
}  // namespace dtsdf
