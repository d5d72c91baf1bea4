#include "dtsdf_mapping/kernels/normal_estimation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace dtsdf {
namespace {

constexpr int kWidth = 40, kHeight = 30;
constexpr Intrinsics kIntrinsics{35.0f, 36.0f, 19.3f, 14.8f};
constexpr NormalFitSettings kSettings{2, 0.03f, 10.0f, 525.0f, 0.0f};

/// A rounding error of a share of 6e-8 of 1 / z, over slopes of the order of 1 / (f z) per pixel,
/// turns the normal by about f * 6e-8; some ten times that.
constexpr double kExact = 2e-5;

struct Image {
  std::vector<float> inverse_depth = std::vector<float>(kWidth * kHeight, 0.0f);

  float& at(int u, int v) { return inverse_depth[static_cast<size_t>(v) * kWidth + u]; }
};

/// n^T P = delta, seen from the origin: n points to the camera for delta < 0.
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

std::vector<Vec3f> fitAll(const Image& image, const NormalFitSettings& settings = kSettings) {
  std::vector<float> value, slope;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const RowFit fit = fitRow(image.inverse_depth.data(), kWidth, u, v, settings);
      value.push_back(fit.value);
      slope.push_back(fit.slope);
    }
  }
  std::vector<Vec3f> normals;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      normals.push_back(
          fitNormal(value.data(), slope.data(), kWidth, kHeight, u, v, kIntrinsics, settings));
    }
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

/// Every pixel of the image, up to its borders and corners. Without a limit of the jump, since at
/// this focal length neighbouring depths of a tilted plane differ by more than it.
TEST(NormalFit, IsExactOnPlanesOfAnyTilt) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> tilt(-0.75, 0.75), distance(0.3, 8.0);
  for (int trial = 0; trial < 200; ++trial) {
    const FreePlane plane = makePlane(tilt(random), tilt(random), -1.0, -distance(random));
    Image image;
    draw(image, plane, [](int, int) { return true; });
    const std::vector<Vec3f> normals = fitAll(image, {4, 1.0f, 10.0f, 525.0f, 0.0f});
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        ASSERT_LT(distanceTo(normals[static_cast<size_t>(v) * kWidth + u], plane), kExact)
            << "trial " << trial << ", pixel " << u << ", " << v;
      }
    }
  }
}

/// Two planes with a gap in depth: no pixel's normal is a mixture, whichever way the border runs.
TEST(NormalFit, DoesNotMixAcrossADepthJump) {
  const FreePlane near = makePlane(0.2, -0.1, -1.0, -1.0), far = makePlane(-0.4, 0.3, -1.0, -1.9);
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

/// A strip three pixels wide between holes still gets the normal of its plane.
TEST(NormalFit, IsOneSidedBesideHoles) {
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

TEST(NormalFit, NeedsNeighboursInBothWays) {
  const FreePlane plane = makePlane(0.0, 0.0, -1.0, -1.0);
  const auto isolated = [](int u, int v) { return u == 5 && v == 5; };
  const auto row = [](int, int v) { return v == 12; };
  const auto column = [](int u, int) { return u == 20; };
  for (const std::function<bool(int, int)>& shape :
       {std::function<bool(int, int)>(isolated), std::function<bool(int, int)>(row),
        std::function<bool(int, int)>(column)}) {
    Image image;
    draw(image, plane, shape);
    for (const Vec3f& n : fitAll(image)) EXPECT_EQ(norm(n), 0.0f);
  }
}

TEST(NormalFit, FacesTheCamera) {
  std::mt19937 random(13);
  std::uniform_real_distribution<float> noise(0.985f, 1.0f);
  Image image;
  for (float& value : image.inverse_depth) value = noise(random);
  const std::vector<Vec3f> normals = fitAll(image);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Vec3f ray =
          backProject(kIntrinsics, static_cast<float>(u), static_cast<float>(v), 1.0f);
      const Vec3f& n = normals[static_cast<size_t>(v) * kWidth + u];
      EXPECT_NEAR(norm(n), 1.0f, 1e-5f);
      EXPECT_LT(dot(n, ray), 0.0f);
    }
  }
}

/// One and a half voxels wide, at least two pixels to each side if the setting allows, never more
/// than it.
TEST(WindowRadius, FollowsTheVoxelsInTheImage) {
  const auto radius = [](float voxel_px_m, float depth_m, int largest) {
    return windowRadius(1.0f / depth_m, {largest, 0.03f, voxel_px_m, 525.0f, 0.0f});
  };
  EXPECT_EQ(radius(12.0f, 1.0f, 16), 9);
  EXPECT_EQ(radius(12.0f, 2.0f, 16), 5);  // 4.5 rounded
  EXPECT_EQ(radius(12.0f, 9.0f, 16), 2);
  EXPECT_EQ(radius(12.0f, 0.1f, 16), 16);
  EXPECT_EQ(radius(12.0f, 1.0f, 1), 1);
  EXPECT_EQ(radius(1e30f, 1e-9f, 8), 8);
}

TEST(InverseDepth, TellsWhatIsNoMeasurement) {
  const float nan = std::nanf(""), infinity = std::numeric_limits<float>::infinity();
  for (const float raw : {0.0f, -1.0f, nan, infinity, -infinity, 99.0f, 10001.0f}) {
    EXPECT_EQ(inverseDepth(raw, 0.001f, 0.1f, 10.0f), 0.0f) << raw;
  }
  EXPECT_FLOAT_EQ(inverseDepth(2000.0f, 0.001f, 0.1f, 10.0f), 0.5f);
}

}  // namespace
}  // namespace dtsdf
