#include "simulation/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance_m = 1e-9;

Scene sceneOf(const Shape& shape) {
  Scene scene;
  scene.add(shape);
  return scene;
}

/// One shape of each type, rotated relative to the axes where possible.
std::vector<Shape> someShapes() {
  return {Plane{Vector3d(0.0, 0.0, -2.0), Vector3d(0.6, 0.0, 0.8)},
          Sphere{Vector3d(0.5, -0.3, 0.2), 0.7},
          makeBox(Vector3d(-0.2, 0.4, 0.1), Vector3d(1.0, 0.02, 0.6), 0.7),
          Rod{Vector3d(-0.5, 0.2, -0.4), Vector3d(0.6, 0.5, 0.3), 0.05},
          Room{Vector3d(-3.0, -3.0, -3.0), Vector3d(3.0, 3.0, 3.0)}};
}

Vector3d randomUnit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

TEST(SceneShapes, PlaneMatchesKnownValues) {
  const Scene scene = sceneOf(Plane{Vector3d(0, 0, 1), Vector3d::UnitZ()});
  EXPECT_DOUBLE_EQ(scene.intersect(Vector3d(5, 5, 3), -Vector3d::UnitZ()), 2.0);
  EXPECT_DOUBLE_EQ(scene.intersect(Vector3d(5, 5, 3), Vector3d(0, 0, -4)), 0.5);
  EXPECT_TRUE(std::isinf(scene.intersect(Vector3d(0, 0, 3), Vector3d::UnitZ())));
  EXPECT_TRUE(std::isinf(scene.intersect(Vector3d(0, 0, -3), Vector3d::UnitZ())));
  EXPECT_DOUBLE_EQ(scene.signedDistance(Vector3d(7, -2, 0.25)), -0.75);
}

TEST(SceneShapes, SphereMatchesKnownValues) {
  const Scene scene = sceneOf(Sphere{Vector3d(1, 0, 0), 0.5});
  EXPECT_DOUBLE_EQ(scene.intersect(Vector3d(-1, 0, 0), Vector3d::UnitX()), 1.5);
  EXPECT_TRUE(std::isinf(scene.intersect(Vector3d(-1, 0.6, 0), Vector3d::UnitX())));
  EXPECT_DOUBLE_EQ(scene.signedDistance(Vector3d(1, 2, 0)), 1.5);
  EXPECT_DOUBLE_EQ(scene.signedDistance(Vector3d(1, 0, 0.1)), -0.4);
}

TEST(SceneShapes, ThinPlateHasTwoSides) {
  const Scene scene = sceneOf(makeBox(Vector3d::Zero(), Vector3d(1.0, 0.01, 1.0)));
  EXPECT_DOUBLE_EQ(scene.intersect(Vector3d(0, -2, 0), Vector3d::UnitY()), 1.995);
  EXPECT_DOUBLE_EQ(scene.intersect(Vector3d(0, 2, 0), -Vector3d::UnitY()), 1.995);
  EXPECT_NEAR(scene.signedDistance(Vector3d(0, 0.105, 0)), 0.1, kTolerance_m);
  EXPECT_NEAR(scene.signedDistance(Vector3d(0.5 + 0.3, 0.005 + 0.4, 0)), 0.5, kTolerance_m);
  EXPECT_DOUBLE_EQ(scene.signedDistance(Vector3d::Zero()), -0.005);
}

TEST(SceneShapes, RodHasFlatEnds) {
  const Scene scene = sceneOf(Rod{Vector3d(0, 0, 0), Vector3d(0, 0, 2), 0.1});
  EXPECT_NEAR(scene.intersect(Vector3d(3, 0, 1), -Vector3d::UnitX()), 2.9, kTolerance_m);
  EXPECT_NEAR(scene.intersect(Vector3d(0.05, 0, 5), -Vector3d::UnitZ()), 3.0, kTolerance_m);
  EXPECT_TRUE(std::isinf(scene.intersect(Vector3d(3, 0, 2.01), -Vector3d::UnitX())));
  EXPECT_NEAR(scene.signedDistance(Vector3d(0.4, 0, 2.4)), 0.5, kTolerance_m);
  EXPECT_NEAR(scene.signedDistance(Vector3d(0, 0, 1)), -0.1, kTolerance_m);
}

TEST(SceneShapes, RoomIsSeenFromInside) {
  const Scene scene = sceneOf(Room{Vector3d(-1, -2, 0), Vector3d(1, 2, 3)});
  EXPECT_DOUBLE_EQ(scene.intersect(Vector3d(0, 0, 1), Vector3d::UnitY()), 2.0);
  EXPECT_DOUBLE_EQ(scene.signedDistance(Vector3d(0, 0, 0.25)), 0.25);
  EXPECT_DOUBLE_EQ(scene.signedDistance(Vector3d(0, 0, -0.5)), -0.5);
  EXPECT_TRUE(std::isinf(scene.intersect(Vector3d(0, 5, 1), -Vector3d::UnitY())));
}

/// Hits lie on the surface, with free space in front of it, so intersections and distances agree.
TEST(SceneProperty, HitsLieOnTheSurface) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5), share(0.0, 1.0);
  for (const Shape& shape : someShapes()) {
    const Scene scene = sceneOf(shape);
    int hits = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vector3d origin(coordinate(random), coordinate(random), coordinate(random));
      if (scene.signedDistance(origin) <= 0.0) continue;
      const Vector3d direction = randomUnit(random);
      const double s = scene.intersect(origin, direction);
      if (std::isinf(s)) continue;
      ++hits;
      ASSERT_LT(scene.distanceToSurface(origin + s * direction), 1e-8) << shape.index();
      ASSERT_GE(scene.signedDistance(origin + share(random) * s * direction), -1e-9);
    }
    EXPECT_GT(hits, 20) << shape.index();
  }
}

/// No surface is nearer than the returned distance, and one is exactly that far away.
TEST(SceneProperty, DistancesAreTight) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  for (const Shape& shape : someShapes()) {
    const Scene scene = sceneOf(shape);
    for (int i = 0; i < 500; ++i) {
      const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
      const double distance = scene.signedDistance(p);
      for (int k = 0; k < 20; ++k) {
        const double there = scene.signedDistance(p + 0.1 * randomUnit(random));
        ASSERT_LE(std::abs(there - distance), 0.1 + kTolerance_m)
            << "the distance should change by at most the length of the step";
      }
      // Where the nearest point is unique, a step along the gradient reaches the surface.
      Vector3d gradient;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d step = 1e-6 * Vector3d::Unit(axis);
        gradient[axis] = (scene.signedDistance(p + step) - scene.signedDistance(p - step)) / 2e-6;
      }
      if (std::abs(gradient.norm() - 1.0) > 1e-6) continue;
      ASSERT_LT(scene.distanceToSurface(p - distance * gradient), 1e-5) << shape.index();
    }
  }
}

TEST(SceneRender, LookAtFollowsTheOpticalFrame) {
  const Eigen::Isometry3d T_W_C = lookAt(Vector3d(1, 2, 3), Vector3d(4, 2, 3), Vector3d::UnitZ());
  EXPECT_TRUE(T_W_C.linear().isUnitary(1e-12));
  EXPECT_NEAR(T_W_C.linear().determinant(), 1.0, 1e-12);
  EXPECT_TRUE((T_W_C * Vector3d(0, 0, 2)).isApprox(Vector3d(3, 2, 3))) << "z should point forward";
  EXPECT_TRUE((T_W_C * Vector3d(0, 1, 0)).isApprox(Vector3d(1, 2, 2))) << "y should point down";
}

/// Rendering skips pixels outside a shape's bounds in the image. The bounds must not cut off any
/// part of the shape.
TEST(SceneRender, EqualsSingleRays) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> coordinate(-1.2, 1.2);
  const Intrinsics K{40, 42, 31, 22};
  Scene scene;
  for (const Shape& shape : someShapes()) scene.add(shape);
  for (int i = 0; i < 30; ++i) {
    const Vector3d eye(coordinate(random), coordinate(random), coordinate(random));
    const Eigen::Isometry3d T_W_C = lookAt(eye, eye + randomUnit(random), randomUnit(random));
    const auto depth_m = renderDepth(scene, K, 64, 48, T_W_C);
    for (int v = 0; v < 48; ++v) {
      for (int u = 0; u < 64; ++u) {
        const Vector3d ray_C((u - 31.0) / 40.0, (v - 22.0) / 42.0, 1.0);
        const double z_m = scene.intersect(eye, T_W_C.linear() * ray_C);
        ASSERT_FLOAT_EQ(depth_m[static_cast<size_t>(v * 64 + u)],
                        std::isinf(z_m) ? 0.0f : static_cast<float>(z_m));
      }
    }
  }
}

}  // namespace
}  // namespace dtsdf
