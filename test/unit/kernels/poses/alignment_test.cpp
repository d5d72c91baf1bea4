// The rules that align an image to the map, against planes and fields that are known.
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

/// Inverse depth of the plane <normal_C, p> = distance_m at a pixel.
float planeAt(const Vec3f& normal_C, float distance_m, const FrameView& view, int u, int v) {
  const Vec3f ray =
      backProject(view.intrinsics, static_cast<float>(u), static_cast<float>(v), 1.0f);
  return dot(normal_C, ray) / distance_m;
}

AlignmentSettings settings() { return {1.0f, 0.03f, AlignmentRules()}; }

/// The distance field of a plane in front of which z is smaller, where z reaches from a voxel to
/// another; elsewhere nothing is known. In the direction Z- alone.
struct PlaneField {
  float z = 50.0f, band = 3.0f;
  Voxel operator()(int direction, const Vec3i& at) const {
    const float sdf = z - static_cast<float>(at.z);
    const bool known = direction == 5 && std::fabs(sdf) <= band;
    return known ? makeVoxel(sdf, 65536, 3) : makeVoxel(0.0f, 0, 0);
  }
};

TEST(AlignedPoint, HasThePlaneOfItsWindow) {
  const FrameView view = camera();
  const Vec3f normal = (1.0f / norm({0.3f, -0.2f, 1.0f})) * Vec3f{0.3f, -0.2f, 1.0f};
  const Pixel pixel{100, 40};
  const AlignedPoint point = makeAlignedPoint(view, pixel, settings(), [&](int32_t du, int32_t dv) {
    return planeAt(normal, 2.0f, view, pixel.u + du, pixel.v + dv);
  });
  ASSERT_GT(point.weight, 0.0f);
  EXPECT_NEAR(dot(normal, point.p_C) * kVoxel_m, 2.0f, 1e-4f);
  EXPECT_NEAR(norm(point.normal_C + normal), 0.0f, 1e-3f);  // towards the camera
  EXPECT_NEAR(point.p_C.x / point.p_C.z, (100.0f - 79.5f) / 130.0f, 1e-5f);
}

TEST(AlignedPoint, IsNotMadeAcrossAnEdgeNorWhereNothingIsMeasured) {
  const FrameView view = camera();
  const auto point = [&](const auto& inverse_depth) {
    return makeAlignedPoint(view, {80, 60}, settings(), inverse_depth).weight;
  };
  EXPECT_GT(point([](int32_t, int32_t) { return 0.5f; }), 0.0f);
  EXPECT_EQ(point([](int32_t du, int32_t) { return du > 0 ? 0.4f : 0.5f; }), 0.0f);
  EXPECT_EQ(point([](int32_t du, int32_t dv) { return du == 0 && dv == 0 ? 0.0f : 0.5f; }), 0.0f);
  EXPECT_EQ(point([](int32_t du, int32_t) { return du > 0 ? 0.0f : 0.5f; }), 0.0f);
  EXPECT_EQ(
      makeAlignedPoint(view, {2, 60}, settings(), [](int32_t, int32_t) { return 0.5f; }).weight,
      0.0f);  // no window at the border
}

TEST(AlignedPoint, CountsLessFarAway) {
  const auto weight = [](float depth_m) {
    return makeAlignedPoint(camera(), {80, 60}, settings(),
                            [=](int32_t, int32_t) { return 1.0f / depth_m; })
        .weight;
  };
  EXPECT_NEAR(weight(0.5f), weight(1.0f), 1e-4f);
  EXPECT_NEAR(weight(4.0f) / weight(2.0f), 0.25f, 1e-3f);
}

TEST(AlignmentGrid, HasAsManyPointsAsAskedForAndAllOfTheImage) {
  FrameView view = camera();
  AlignmentRules rules;
  for (const int32_t points : {100, 1000, 4800, 100000}) {
    rules.points = points;
    const AlignmentGrid grid = alignmentGrid(view, rules);
    EXPECT_GE(grid.columns * grid.rows, std::min(points, view.width * view.height));
    const Pixel last = pixelOfPoint(grid, grid.columns * grid.rows - 1);
    EXPECT_LT(last.u, view.width);
    EXPECT_LT(last.v, view.height);
    EXPECT_GT(last.u, view.width - 2 * grid.stride - 1);
  }
}

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
                 contradicted.state &= ~255u;  // no frame supports it any more
                 return contradicted;
               }).known);
}

TEST(FindSurface, LooksAlongTheNormalWhereTheMapHoldsNothing) {
  const Vec3f normal{0.0f, 0.0f, -1.0f};
  const auto distance = [&](float z, float reach) {
    return findSurface({0.5f, 0.5f, z}, normal, true, reach, PlaneField());
  };
  for (const float z : {43.3f, 49.3f, 51.2f, 56.7f}) {
    const FieldSample found = distance(z, 8.0f);
    ASSERT_TRUE(found.known) << z;
    EXPECT_NEAR(found.sdf, 50.0f - z, 1e-2f);
    EXPECT_NEAR(found.gradient.z, -1.0f, 1e-3f);
  }
  EXPECT_FALSE(distance(43.3f, 2.0f).known);
  EXPECT_FALSE(distance(30.0f, 8.0f).known);
}

TEST(FindSurface, TheBackOfASheetDoesNotAttractItsFront) {
  const Vec3f to_the_back{0.0f, 0.0f, 1.0f};
  EXPECT_FALSE(findSurface({0.5f, 0.5f, 50.0f}, to_the_back, true, 8.0f, PlaneField()).known);
}

/// As addPoint() wants it, of the plane's map.
auto findIn(float cutoff) {
  return [=](const Vec3f& p_L, const Vec3f& normal) {
    return findSurface(p_L, normal, true, cutoff, PlaneField());
  };
}

/// The sums of one point against the derivative of its residual by differences.
TEST(AddPoint, HasTheDerivativeOfTheResidual) {
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
  constexpr float kCutoff = 100.0f;  // nearly no robust weight
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

TEST(AddPoint, LeavesOutliersOut) {
  AlignmentSums sums{};
  const AlignedPoint point{{0.0f, 0.0f, 47.5f}, {0.0f, 0.0f, -1.0f}, 1.0f};
  addPoint(sums, camera(), point, 1.0f, findIn(1.0f));
  EXPECT_EQ(sums.points, 1);
  EXPECT_EQ(sums.matched, 1);
  EXPECT_EQ(sums.inliers, 0);
  EXPECT_EQ(sums.weight, 0);
}

TEST(AlignedPoint, HasItsWholeWindowInTheImage) {
  const FrameView view = camera();
  const int32_t r = settings().rules.window_px, right = view.width - 1, low = view.height - 1;
  const auto isPoint = [&](int32_t u, int32_t v) {
    return makeAlignedPoint(view, {u, v}, settings(), [](int32_t, int32_t) {
             return 0.5f;
           }).weight > 0.0f;
  };
  for (const int32_t u : {r, right - r}) EXPECT_TRUE(isPoint(u, 60)) << u;
  for (const int32_t u : {0, r - 1, right - r + 1, right}) EXPECT_FALSE(isPoint(u, 60)) << u;
  for (const int32_t v : {r, low - r}) EXPECT_TRUE(isPoint(80, v)) << v;
  for (const int32_t v : {0, r - 1, low - r + 1, low}) EXPECT_FALSE(isPoint(80, v)) << v;
}

}  // namespace alignment_test
}  // namespace dtsdf
