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
constexpr float kVoxel_m = 10.0f / 35.0f;  // 10 pixels at 1 m
const SurfelSettings kSurfels{2, 0.03f, SurfelRules(), 0};

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

std::vector<PixelPlane> planesOf(const Image& image, const SurfelSettings& surfels) {
  const FrameView frame{kWidth, kHeight, kIntrinsics, {}, {0, 0, 0}, kVoxel_m};
  const FitWindow window = fitWindow(frame, {0.0f, 0}, surfels);
  const std::vector<PixelLinks> links =
      linksOfImage(frame, image.inverse_depth, {0.0f, 0}, surfels);
  std::vector<float> value, slope;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const RowFit fit =
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

/// Normals of those pixels that have both fits.
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

/// Every pixel of the image, up to its borders and corners. Without a limit of the jump, since at
/// this focal length neighbouring depths of a tilted plane differ by more than it.
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

/// Two planes with a gap in depth: no pixel's normal is a mixture, whichever way the border runs.
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

/// An image of one column, or row, of a plane with others to both sides of it at half the distance.
Image slitImage(const FreePlane& plane, bool is_row) {
  Image image;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool in_slit = is_row ? v == 12 : u == 20;
      image.at(u, v) = static_cast<float>((in_slit ? 1.0 : 2.0) * plane.inverseDepth(u, v));
    }
  }
  return image;
}

/// What shows through a slit one pixel wide: the normal is square to the line in space, square to
/// the image's other axis, faces the camera, and is trusted little.
TEST(NormalFit, FollowsAStripOnePixelWide) {
  const FreePlane plane = makePlane(0.5, -0.4, -1.0, -1.0);
  const auto point = [&](int u, int v) {
    return backProject(kIntrinsics, static_cast<float>(u), static_cast<float>(v),
                       static_cast<float>(1.0 / plane.inverseDepth(u, v)));
  };
  for (const bool is_row : {true, false}) {
    const std::vector<PixelPlane> planes =
        planesOf(slitImage(plane, is_row), {4, 0.3f, SurfelRules(), 0});
    const Vec3f along = is_row ? point(30, 12) - point(5, 12) : point(20, 25) - point(20, 3);
    for (int i = 0; i < (is_row ? kWidth : kHeight); ++i) {
      const int u = is_row ? i : 20, v = is_row ? 12 : i;
      const PixelPlane& found = planes[static_cast<size_t>(v) * kWidth + u];
      EXPECT_NEAR(norm(found.normal_C), 1.0f, 1e-5f);
      EXPECT_NEAR(dot(found.normal_C, along) / norm(along), 0.0f, 1e-4f);
      EXPECT_LT(dot(found.normal_C, point(u, v)), 0.0f);
      EXPECT_EQ(is_row ? found.slope_v : found.slope_u, 0.0f);
      EXPECT_EQ(found.trust, SurfelRules().strip_weight);
    }
  }
}

/// A column in front of both its neighbours, or behind both, is a strip; one that lies between them
/// is a mixture of the two, and where one of them is not measured there is no telling.
TEST(NormalFit, TellsStripsFromMixedPixels) {
  const auto trustIn = [](double left_m, double middle_m, double right_m) {
    Image image;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const double depth_m = u < 20 ? left_m : (u == 20 ? middle_m : right_m);
        image.at(u, v) = depth_m > 0.0 ? static_cast<float>(1.0 / depth_m) : 0.0f;
      }
    }
    return planesOf(image, kSurfels)[12 * kWidth + 20].trust;
  };
  EXPECT_EQ(trustIn(2.0, 1.0, 3.0), SurfelRules().strip_weight);
  EXPECT_EQ(trustIn(1.0, 3.0, 2.0), SurfelRules().strip_weight);
  EXPECT_EQ(trustIn(1.0, 2.0, 3.0), 0.0f);
  EXPECT_EQ(trustIn(3.0, 2.0, 1.0), 0.0f);
  EXPECT_EQ(trustIn(1.0, 3.0, 0.0), 0.0f);
  EXPECT_EQ(trustIn(0.0, 3.0, 0.0), 0.0f);
}

/// A pixel alone, and two side by side, tell no direction.
TEST(NormalFit, NeedsALineOfThree) {
  for (const int length : {1, 2, 3}) {
    Image image;
    for (float& value : image.inverse_depth) value = 0.5f;
    for (int u = 20; u < 20 + length; ++u) image.at(u, 12) = 1.0f;
    const std::vector<PixelPlane> planes = planesOf(image, kSurfels);
    for (int u = 20; u < 20 + length; ++u) {
      EXPECT_EQ(norm(planes[12 * kWidth + u].normal_C) > 0.0f, length == 3) << length;
    }
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

/// One and a half voxels wide, at least one pixel to each side, never more than the setting.
TEST(WindowRadius, FollowsTheVoxelsInTheImage) {
  const auto radius = [](float voxel_px_m, float depth_m, int largest) {
    const FrameView frame{kWidth, kHeight, {525.0f, 525.0f, 0, 0}, {}, {}, voxel_px_m / 525.0f};
    const SurfelSettings surfels{largest, 0.03f, SurfelRules(), 0};
    return windowRadius(1.0f / depth_m, fitWindow(frame, {0.0f, 0}, surfels)).both;
  };
  EXPECT_EQ(radius(12.0f, 1.0f, 16), 9);
  EXPECT_EQ(radius(12.0f, 2.0f, 16), 5);  // 4.5 rounded
  EXPECT_EQ(radius(12.0f, 9.0f, 16), 1);
  EXPECT_EQ(radius(12.0f, 0.1f, 16), 16);
  EXPECT_EQ(radius(12.0f, 1.0f, 1), 1);
  EXPECT_EQ(radius(1e30f, 1e-9f, 8), 8);
}

}  // namespace plane_fit_test
}  // namespace dtsdf
