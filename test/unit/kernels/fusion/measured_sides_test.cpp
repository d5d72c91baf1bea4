// Where the surface of a wide pixel or a subpixel was measured, against points all over it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/fusion/cast.h"

namespace dtsdf {
namespace measured_sides_test {

/// A camera at the origin that looks along z; voxels of 20 mm.
FrameSensing sensingAtOrigin() {
  FrameSensing sensing{};
  FrameView& frame = sensing.image.frame;
  frame.intrinsics = {500.0f, 400.0f, 320.0f, 240.0f};
  frame.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  frame.voxel_size_m = 0.02f;
  frame.width = 640;
  frame.height = 480;
  return sensing;
}

FusionSettings castAlongNormals() { return {1, 0, 4.0f, 64.0f, FusionRules()}; }

/// 2 m away, seen at an angle.
Surfel slantedSurfel(const Footprint& footprint_px) {
  const Vec3f p{20.3f, -10.2f, 100.1f}, normal{0.48f, 0.6f, -0.64f};
  return {p, 1.0f, normal, 0.02f * p.z, footprint_px};
}

/// Where the surfel's plane is seen so many pixels beside it.
Vec3f onPlaneBeside(const Surfel& surfel, float pixels_u, float pixels_v) {
  const Intrinsics K = sensingAtOrigin().image.frame.intrinsics;
  const Vec3f& p = surfel.p_L;
  const Vec3f ray{p.x + p.z * pixels_u / K.fx, p.y + p.z * pixels_v / K.fy, p.z};
  return (dot(surfel.normal_L, p) / dot(surfel.normal_L, ray)) * ray;
}

/// The point that each voxel gets from a surfel.
template <class Visit>
void visitPoints(const Surfel& surfel, const Visit& visit) {
  const CastLine cast = makeCastLine(surfel, sensingAtOrigin(), castAlongNormals());
  const auto add = [&](const Vec3i& voxel_L, const CornerSample& sample, int32_t) {
    if (sample.point_key == 0) return;
    const Vec3f voxel = toFloat(voxel_L);
    visit(voxel, voxel + pointOffset(sample.point_key));
  };
  castSurfel(cast, castAlongNormals(), add);
}

float squaredDistance(const Vec3f& a, const Vec3f& b) { return dot(a - b, a - b); }

/// Of the points that a subpixel shows, the nearest to where the voxel's foot is.
Vec3f nearestOfAll(const Surfel& surfel, const Vec3f& voxel) {
  const Vec3f foot = voxel - dot(voxel - surfel.p_L, surfel.normal_L) * surfel.normal_L;
  Vec3f nearest = surfel.p_L;
  constexpr int kSteps = 50;
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      const Vec3f point = onPlaneBeside(surfel, surfel.footprint_px.across * i / kSteps,
                                        surfel.footprint_px.down * j / kSteps);
      if (squaredDistance(point, foot) < squaredDistance(nearest, foot)) nearest = point;
    }
  }
  return nearest;
}

void expectNearestOfAll(const Footprint& footprint_px) {
  const Surfel surfel = slantedSurfel(footprint_px);
  int voxels = 0;
  visitPoints(surfel, [&](const Vec3f& voxel, const Vec3f& point) {
    ++voxels;
    EXPECT_LT(norm(point - nearestOfAll(surfel, voxel)), 0.02f);  // a key has steps of 1 / 127
  });
  EXPECT_GE(voxels, 5);
}

TEST(MeasuredPoint, OfAPixelIsItsMiddle) {
  int voxels = 0;
  visitPoints(slantedSurfel({0.0f, 0.0f}), [&](const Vec3f&, const Vec3f& point) {
    ++voxels;
    EXPECT_LT(norm(point - slantedSurfel({}).p_L), 0.01f);
  });
  EXPECT_GE(voxels, 5);
}

/// Pixels wide enough for their sides to matter: 2.5 of them to a voxel, face on.
TEST(MeasuredPoint, OfASubpixelIsItsNearestToTheFoot) {
  expectNearestOfAll({0.0f, 2.0f});
  expectNearestOfAll({2.0f, 0.0f});
}

/// Along one axis of the image after the other: at an angle, that is near to the nearest, and in
/// it.
TEST(MeasuredPoint, OfASubpixelDividedTwiceIsNearerThanItsMiddle) {
  const Surfel surfel = slantedSurfel({1.0f, 1.0f});
  visitPoints(surfel, [&](const Vec3f& voxel, const Vec3f& point) {
    const Vec3f foot = voxel - dot(voxel - surfel.p_L, surfel.normal_L) * surfel.normal_L;
    const float best = norm(nearestOfAll(surfel, voxel) - foot), found = norm(point - foot);
    EXPECT_GT(found, best - 0.02f);
    EXPECT_LT(found, best + 0.35f * (norm(surfel.p_L - foot) - best) + 0.02f);
  });
}

}  // namespace measured_sides_test
}  // namespace dtsdf
