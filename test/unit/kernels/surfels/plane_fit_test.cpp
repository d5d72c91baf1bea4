#include "kernels/surfels/plane_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "support/links_of_image.h"

namespace dtsdf {
namespace plane_fit_test {

constexpr int kWidth = 40, kHeight = 30;
constexpr Intrinsics kIntrinsics{35.0f, 36.0f, 19.3f, 14.8f};
constexpr float kVoxel_m = 10.0f / 35.0f;  // a voxel is 10 pixels wide at 1 m
const SurfelSettings kSurfels{2, 0.03f, SurfelRules(), 0};

/// A relative rounding error of 6e-8 in 1 / z turns the normal by about f * 6e-8, where f is the
/// focal length in pixels. This tolerance is about ten times as large.
constexpr double kExact = 2e-5;

struct Image {
  std::vector<float> inverse_depth = std::vector<float>(kWidth * kHeight, 0.0f);

  float& at(int u, int v) { return inverse_depth[static_cast<size_t>(v) * kWidth + u]; }
};

/// The plane n^T P = delta in the camera's frame. If delta < 0, n points towards the camera.
struct FreePlane {
  double n[3];
  double delta;

  double inverseDepth(int u, int v) const {
    const double x = (u - double(kIntrinsics.cx)) / kIntrinsics.fx;
    const double y = (v - double(kIntrinsics.cy)) / kIntrinsics.fy;
    return (n[0] * x + n[1] * y + n[2]) / delta;
  }
};

void draw(Image& image, const FreePlane& plane, const std::function<bool(int, int)>& inside) {
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (inside(u, v)) image.at(u, v) = static_cast<float>(plane.inverseDepth(u, v));
    }
  }
}

std::vector<PixelPlane> planesOf(const Image& image, const SurfelSettings& surfels) {
  const FrameView frame{kWidth, kHeight, kIntrinsics, {}, {0, 0, 0}, kVoxel_m};
  const FitWindow window = fitWindow(frame, {0.0f, 0}, surfels);
  const std::vector<PixelLinks> links =
      linksOfImage(frame, image.inverse_depth, {0.0f, 0}, surfels);
  std::vector<float> value, slope;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const LineFit fit =
          fitRow(&image.inverse_depth[v * kWidth], &links[v * kWidth], kWidth, u, window);
      value.push_back(fit.value);
      slope.push_back(fit.slope);
    }
  }
  const FrameSensing sensing{
      {frame, image.inverse_depth.data(), value.data(), slope.data(), links.data()},
      {0.0f, 0},
      nullptr};
  std::vector<PixelPlane> planes;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      PixelPlane plane{{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f, 0.0f};
      if (image.inverse_depth[static_cast<size_t>(v) * kWidth + u] > 0.0f) {
        plane = pixelPlane(sensing, {u, v}, fitColumn(sensing, {u, v}, surfels), surfels);
      }
      planes.push_back(plane);
    }
  }
  return planes;
}

/// The normals of all pixels; 0 where no line was fitted along the row or column.
std::vector<Vec3f> fitAll(const Image& image, const SurfelSettings& surfels = kSurfels) {
  std::vector<Vec3f> normals;
  for (const PixelPlane& plane : planesOf(image, surfels)) {
    normals.push_back(plane.trust == 1.0f ? plane.normal_C : Vec3f{0.0f, 0.0f, 0.0f});
  }
  return normals;
}

double distanceTo(const Vec3f& n, const FreePlane& plane) {
  return std::sqrt(std::pow(n.x - plane.n[0], 2) + std::pow(n.y - plane.n[1], 2) +
                   std::pow(n.z - plane.n[2], 2));
}

FreePlane makePlane(double x, double y, double z, double delta) {
  const double length = std::sqrt(x * x + y * y + z * z);
  return {{x / length, y / length, z / length}, delta};
}

/// Tests every pixel, including borders and corners. There is no depth jump limit, since
/// neighbouring depths on a tilted plane would exceed it at this short focal length.
TEST(NormalFit, IsExactOnPlanesOfAnyTilt) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> tilt(-0.75, 0.75), distance(0.3, 8.0);
  for (int trial = 0; trial < 200; ++trial) {
    const FreePlane plane = makePlane(tilt(random), tilt(random), -1.0, -distance(random));
    Image image;
    draw(image, plane, [](int, int) { return true; });
    const std::vector<Vec3f> normals = fitAll(image, {4, 1.0f, SurfelRules(), 0});
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        ASSERT_LT(distanceTo(normals[static_cast<size_t>(v) * kWidth + u], plane), kExact)
            << "trial " << trial << ", pixel " << u << ", " << v;
      }
    }
  }
}

/// Two planes with a jump in depth along a slanted border. No normal may mix both planes.
TEST(NormalFit, DoesNotMixAcrossADepthJump) {
  const FreePlane near = makePlane(0.2, -0.1, -1.0, -2.0), far = makePlane(-0.4, 0.3, -1.0, -3.8);
  const auto onNear = [](int u, int v) { return 3 * u + 5 * v < 120; };
  Image image;
  draw(image, near, onNear);
  draw(image, far, [&](int u, int v) { return !onNear(u, v); });
  const std::vector<Vec3f> normals = fitAll(image);
  int fitted = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Vec3f& n = normals[static_cast<size_t>(v) * kWidth + u];
      if (!(norm(n) > 0.0f)) continue;
      ++fitted;
      ASSERT_LT(distanceTo(n, onNear(u, v) ? near : far), kExact) << u << ", " << v;
    }
  }
  EXPECT_GT(fitted, kWidth * kHeight * 95 / 100);
}

/// On a strip three pixels wide between holes, the normal is that of the strip's plane.
TEST(NormalFit, IsExactOnStripsBetweenHoles) {
  const FreePlane plane = makePlane(0.3, 0.4, -1.0, -1.2);
  Image image;
  draw(image, plane, [](int u, int) { return u >= 10 && u < 13; });
  const std::vector<Vec3f> normals = fitAll(image);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Vec3f& n = normals[static_cast<size_t>(v) * kWidth + u];
      if (u >= 10 && u < 13) {
        EXPECT_LT(distanceTo(n, plane), kExact) << u << ", " << v;
      } else {
        EXPECT_EQ(norm(n), 0.0f) << u << ", " << v;
      }
    }
  }
}

}  // namespace plane_fit_test
}  // namespace dtsdf
