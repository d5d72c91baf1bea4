// Pixels between rays, against planes that are known.
#include "kernels/render/between_rays.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

FrameView makeView() {
  FrameView view{};
  view.width = 64;
  view.height = 48;
  view.intrinsics = {50.0f, 55.0f, 31.5f, 23.5f};
  view.voxel_size_m = 0.02f;
  return view;
}

constexpr Pixel kSquare{20, 12};

/// Where a pixel's ray meets the plane through (0, 0, depth) with a normal in the camera's frame.
RenderedPixel onPlane(const FrameView& view, const Vec3f& normal, float depth, const Pixel& at) {
  const Vec3f way =
      backProject(view.intrinsics, static_cast<float>(at.u), static_cast<float>(at.v), 1.0f);
  return {depth * normal.z / dot(normal, way),
          normal,
          {static_cast<uint8_t>(4 * at.u), static_cast<uint8_t>(4 * at.v), 50, 255}};
}

Vec3f slanted() { return (1.0f / norm({0.4f, -0.3f, -1.0f})) * Vec3f{0.4f, -0.3f, -1.0f}; }

RaySquare planeSquare(const FrameView& view, float depth, int32_t stride) {
  return raysOf(kSquare, stride,
                [&](const Pixel& at) { return onPlane(view, slanted(), depth, at); });
}

TEST(BetweenRays, APlaneIsExact) {
  const FrameView view = makeView();
  const RaySquare rays = planeSquare(view, 10.0f, 4);
  ASSERT_TRUE(meetsPlane(view, kSquare, 4, rays));
  for (int32_t v = 0; v < 4; ++v) {
    for (int32_t u = 0; u < 4; ++u) {
      const Pixel at{kSquare.u + u, kSquare.v + v};
      const RenderedPixel expected = onPlane(view, slanted(), 10.0f, at);
      const RenderedPixel found = pixelBetween(rays, kSquare, 4, at);
      EXPECT_NEAR(found.depth, expected.depth, 1e-4f);
      EXPECT_NEAR(dot(found.normal_C, expected.normal_C), 1.0f, 1e-6f);
      EXPECT_EQ(found.colour.red, expected.colour.red);
      EXPECT_EQ(found.colour.green, expected.colour.green);
      EXPECT_EQ(found.colour.painted, 255);
    }
  }
}

/// Steps, folds and ends of surfaces are left to rays.
TEST(BetweenRays, WhatIsNoPlaneIsLeftOpen) {
  const FrameView view = makeView();
  for (int k = 0; k < 4; ++k) {
    for (const float change : {-0.5f, 0.5f, -10.0f}) {  // -10: no surface
      RaySquare rays = planeSquare(view, 10.0f, 4);
      rays.corner[k].depth += change;
      if (change == -10.0f) rays.corner[k].depth = 0.0f;
      EXPECT_FALSE(meetsPlane(view, kSquare, 4, rays)) << k << ", " << change;
    }
  }
  // Two by two on surfaces one behind the other: their depths alone would be those of a plane.
  RaySquare step = planeSquare(view, 10.0f, 4);
  step.corner[1] = step.corner[3] = onPlane(view, slanted(), 12.0f, {24, 12});
  EXPECT_FALSE(meetsPlane(view, kSquare, 4, step));
}

/// Rays a voxel apart may have something between them.
TEST(BetweenRays, FarAwayRaysAreTooFarApart) {
  const FrameView view = makeView();  // 4 pixels are a voxel at a depth of 12.5
  EXPECT_TRUE(meetsPlane(view, kSquare, 4, planeSquare(view, 11.0f, 4)));
  EXPECT_FALSE(meetsPlane(view, kSquare, 4, planeSquare(view, 14.0f, 4)));
  EXPECT_TRUE(meetsPlane(view, kSquare, 2, planeSquare(view, 14.0f, 2)));
}

TEST(BetweenRays, ColoursThatAreNotThereDoNotCount) {
  const FrameView view = makeView();
  RaySquare rays = planeSquare(view, 10.0f, 4);
  for (int k = 1; k < 4; ++k) rays.corner[k].colour = {0, 0, 0, 0};
  const RenderedPixel found = pixelBetween(rays, kSquare, 4, {kSquare.u + 2, kSquare.v + 2});
  EXPECT_EQ(found.colour.red, rays.corner[0].colour.red);
  EXPECT_EQ(found.colour.painted, 255);
}

}  // namespace
}  // namespace dtsdf
