// Tests the alignment of images to a map, on known planes and fields.
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/poses/alignment_sums.h"

namespace dtsdf {
namespace alignment_test {

constexpr float kVoxel_m = 0.02f;

FrameView camera() {
  FrameView view{};
  view.width = 160;
  view.height = 120;
  view.intrinsics = {130.0f, 130.0f, 79.5f, 59.5f};
  view.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.0f, 0.0f, 0.0f}};
  view.voxel_size_m = kVoxel_m;
  return view;
}

/// The distance field of a plane that faces -z, stored for direction Z-. Distances are known up to
/// `band` voxels from the plane.
struct PlaneField {
  float z = 50.0f, band = 3.0f;
  Voxel operator()(int direction, const Vec3i& at) const {
    const float sdf = z - static_cast<float>(at.z);
    const bool known = direction == 5 && std::fabs(sdf) <= band;
    return known ? makeVoxel(sdf, 65536, 3) : makeVoxel(0.0f, 0, 0);
  }
};

TEST(SampleField, IsExactForALinearField) {
  const auto voxel = [](const Vec3i& at) {
    return makeVoxel(0.25f * static_cast<float>(at.x) - 0.5f * static_cast<float>(at.y) +
                         0.125f * static_cast<float>(at.z),
                     65536, 1);
  };
  const FieldSample sample = sampleField({1.25f, -2.5f, 3.75f}, voxel);
  ASSERT_TRUE(sample.known);
  EXPECT_NEAR(sample.sdf, 0.25f * 1.25f + 0.5f * 2.5f + 0.125f * 3.75f, 1e-3f);
  EXPECT_NEAR(sample.gradient.x, 0.25f, 1e-3f);
  EXPECT_NEAR(sample.gradient.y, -0.5f, 1e-3f);
  EXPECT_NEAR(sample.gradient.z, 0.125f, 1e-3f);
  EXPECT_FALSE(sampleField({1.25f, -2.5f, 3.75f}, [&](const Vec3i& at) {
                 return at.x == 2 ? makeVoxel(0.0f, 0, 0) : voxel(at);
               }).known);
  EXPECT_FALSE(sampleField({1.25f, -2.5f, 3.75f}, [&](const Vec3i& at) {
                 Voxel contradicted = voxel(at);
                 contradicted.state &= ~255u;  // clears its evidence
                 return contradicted;
               }).known);
}

TEST(FindSurface, TheBackOfASheetDoesNotAttractItsFront) {
  const Vec3f to_the_back{0.0f, 0.0f, 1.0f};
  EXPECT_FALSE(findSurface({0.5f, 0.5f, 50.0f}, to_the_back, true, 8.0f, PlaneField()).known);
}

/// The function that addPoint() calls to find the surface, here in a PlaneField.
auto findIn(float cutoff) {
  return [=](const Vec3f& p_L, const Vec3f& normal) {
    return findSurface(p_L, normal, true, cutoff, PlaneField());
  };
}

/// Compares the sums for one point with the numerical derivative of its residual.
TEST(AddPoint, MatchesTheNumericalDerivative) {
  const FrameView view = camera();
  const AlignedPoint point{{8.0f, -5.0f, 49.6f}, {0.0f, 0.0f, -1.0f}, 1.0f};
  const auto residual = [&](int parameter, float step) {
    FrameView moved = view;
    if (parameter >= 3) {
      float* const t[] = {&moved.T_L_C.t.x, &moved.T_L_C.t.y, &moved.T_L_C.t.z};
      *t[parameter - 3] += step;
    } else {
      const float c = std::cos(step), s = std::sin(step);
      const float R[3][9] = {
          {1, 0, 0, 0, c, -s, 0, s, c}, {c, 0, s, 0, 1, 0, -s, 0, c}, {c, -s, 0, s, c, 0, 0, 0, 1}};
      std::copy(R[parameter], R[parameter] + 9, moved.T_L_C.R);
    }
    const Vec3f p_L = transform(moved.T_L_C, point.p_C);
    return findSurface(p_L, {0.0f, 0.0f, -1.0f}, true, 3.0f, PlaneField()).sdf;
  };
  AlignmentSums sums{};
  constexpr float kCutoff = 100.0f;  // almost no robust weighting
  addPoint(sums, view, point, kCutoff, findIn(kCutoff));
  ASSERT_EQ(sums.inliers, 1);
  const float at = residual(0, 0.0f);
  for (int i = 0; i < 6; ++i) {
    const float step = i < 3 ? 0.002f : 0.1f;
    const float slope = (residual(i, step) - residual(i, -step)) / (2.0f * step);
    EXPECT_NEAR(static_cast<float>(sums.right[i]) / kAlignmentScale, slope * at, 0.02f) << i;
  }
  EXPECT_NEAR(static_cast<double>(sums.squares) / kAlignmentScale, at * at, 1e-3);
}

}  // namespace alignment_test
}  // namespace dtsdf
