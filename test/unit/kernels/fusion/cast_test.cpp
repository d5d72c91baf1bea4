// Compares castDirection(), the direction in which a surfel updates voxels, with its definition.
#include "kernels/fusion/cast.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "support/random_vectors.h"

namespace dtsdf {
namespace cast_test {

Eigen::Vector3d toEigen(const Vec3f& v) { return {v.x, v.y, v.z}; }

/// A view ray, in voxels, that hits a surface from the front.
Vec3f rayOnto(const Vec3f& normal, std::mt19937& random) {
  Vec3f ray;
  do {
    ray = randomUnit(random);
  } while (dot(ray, normal) > -0.05f);
  return 80.0f * ray;
}

/// No other displacement that moves the point one voxel off the surface has a smaller Mahalanobis
/// distance.
TEST(LikelyDirection, MinimisesTheMahalanobisDistance) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> noise(0.0f, 3.0f);
  for (int i = 0; i < 1000; ++i) {
    const Vec3f normal = randomUnit(random), ray = rayOnto(normal, random);
    const float noise_voxels = noise(random);
    const Eigen::Vector3d n = toEigen(normal), r = toEigen(ray).normalized();
    const Eigen::Matrix3d C =
        Eigen::Matrix3d::Identity() + noise_voxels * noise_voxels * r * r.transpose();
    const auto distance = [&](const Eigen::Vector3d& way) {
      return std::sqrt(way.dot(C.inverse() * way));
    };
    const Eigen::Vector3d direction = toEigen(castDirection(normal, ray, noise_voxels));
    EXPECT_NEAR(direction.norm(), 1.0, 1e-5);
    const Eigen::Vector3d way = direction / direction.dot(n);
    const Eigen::Vector3d aside = 0.1 * toEigen(randomUnit(random));
    EXPECT_LT(distance(way), distance(way + aside - aside.dot(n) * n) + 1e-5);
  }
}

}  // namespace cast_test
}  // namespace dtsdf
