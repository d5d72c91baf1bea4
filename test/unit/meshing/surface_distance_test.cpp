#include "meshing/surface_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

Vector3d toEigen(const Vec3f& v) {
  return Vector3d(static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z));
}

/// The distance from p to a triangle by brute force: the minimum over a fine grid of points on the
/// triangle.
double sampledDistance(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  constexpr int kSteps = 60;
  double least = 1e9;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; i + j <= kSteps; ++j) {
      const double s = i / static_cast<double>(kSteps), t = j / static_cast<double>(kSteps);
      least = std::min(least, (a + s * (b - a) + t * (c - a) - p).norm());
    }
  }
  return least;
}

struct Soup {
  std::vector<Vec3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;

  explicit Soup(std::mt19937& random, int count) {
    std::uniform_real_distribution<float> place(-1.0f, 1.0f), shift(-0.2f, 0.2f);
    for (int i = 0; i < count; ++i) {
      const Vec3f at{place(random), place(random), place(random)};
      for (int k = 0; k < 3; ++k) {
        vertices.push_back(at + Vec3f{shift(random), shift(random), shift(random)});
      }
      const auto first = static_cast<uint32_t>(3 * i);
      triangles.push_back({first, first + 1, first + 2});
    }
  }

  Vector3d corner(size_t triangle, int k) const {
    return toEigen(vertices[triangles[triangle][static_cast<size_t>(k)]]);
  }
};

TEST(SurfaceTree, FindsTheDistanceToTheNearestTriangle) {
  std::mt19937 random(3);
  const Soup soup(random, 60);
  const SurfaceTree tree(soup.vertices, soup.triangles);
  std::uniform_real_distribution<float> place(-1.3f, 1.3f);
  for (int n = 0; n < 60; ++n) {
    const Vec3f p{place(random), place(random), place(random)};
    double expected = 1e9;
    for (size_t i = 0; i < soup.triangles.size(); ++i) {
      expected = std::min(expected, sampledDistance(toEigen(p), soup.corner(i, 0),
                                                    soup.corner(i, 1), soup.corner(i, 2)));
    }
    EXPECT_NEAR(tree.distance(p, 10.0), expected, 2e-3);
    EXPECT_LE(tree.distance(p, 10.0), expected + 1e-6);
    EXPECT_EQ(tree.distance(p, 0.25 * expected), 0.25 * expected);
  }
}

TEST(SurfaceTree, IgnoresTrianglesWithOtherFacings) {
  // Two squares, one above the other. The lower square faces up, the upper square down.
  const std::vector<Vec3f> vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                       {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const std::vector<std::array<uint32_t, 3>> triangles = {
      {0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}};
  const SurfaceTree tree(vertices, triangles);
  const Vec3f p{0.5f, 0.4f, 0.25f}, up{0, 0, 1};
  EXPECT_NEAR(tree.distance(p, 9.0), 0.25, 1e-6);
  SurfaceTree::Hint hint = SurfaceTree::kNoHint;
  EXPECT_NEAR(tree.distance(p, 9.0, up, 1.01f, hint), 0.25, 1e-6);
  EXPECT_NEAR(tree.distance(p, 9.0, up, -0.5f, hint), 0.75, 1e-6);
  EXPECT_EQ(tree.distance(p, 9.0, up, -1.01f, hint), 9.0);
}

TEST(SurfaceTree, AHintDoesNotChangeTheResult) {
  std::mt19937 random(5);
  const Soup soup(random, 200);
  const SurfaceTree tree(soup.vertices, soup.triangles);
  std::uniform_real_distribution<float> place(-1.3f, 1.3f);
  SurfaceTree::Hint last = SurfaceTree::kNoHint;
  for (int n = 0; n < 200; ++n) {
    const Vec3f p{place(random), place(random), place(random)};
    const float greatest_cosine = n % 2 == 0 ? -0.25f : 0.5f;
    SurfaceTree::Hint none = SurfaceTree::kNoHint;
    const double expected = tree.distance(p, 0.7, {0, 0, 1}, greatest_cosine, none);
    EXPECT_EQ(tree.distance(p, 0.7, {0, 0, 1}, greatest_cosine, last), expected);
    if (expected < 0.7) {
      EXPECT_EQ(last, none);
    }
  }
}

TEST(SurfaceTree, DegenerateTrianglesAreSegmentsOrPoints) {
  const std::vector<Vec3f> vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const std::vector<std::array<uint32_t, 3>> triangles = {{0, 1, 2}, {0, 0, 0}};
  const SurfaceTree tree(vertices, triangles);
  EXPECT_NEAR(tree.distance({1.5f, 2.0f, 0.0f}, 9.0), 2.0, 1e-6);
  EXPECT_NEAR(tree.distance({-3.0f, 4.0f, 0.0f}, 9.0), 5.0, 1e-6);
}

}  // namespace
}  // namespace dtsdf
