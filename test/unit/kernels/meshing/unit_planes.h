/// Fills mesh units (cubes with eight voxels as corners) with samples of planes, as fusion would.
#pragma once

#include <random>

#include "support/unit_samples.h"
#include "unit/kernels/meshing/cube_geometry.h"

namespace dtsdf {

/// The plane n^T x = offset in the unit [0, 1]^3, with free space on the side that n points to.
struct UnitPlane {
  Eigen::Vector3d n;
  double offset;

  float at(int corner) const { return static_cast<float>(n.dot(cornerPoint(corner)) - offset); }
};

/// Sets the samples of one direction at all corners to their distances from the plane.
inline void addPlaneTo(UnitSamples& samples, int direction, const UnitPlane& plane,
                       float weight = 1.0f) {
  for (int c = 0; c < kCubeCorners; ++c) samples.corner[direction][c] = {plane.at(c), weight};
}

/// Sets the samples of every direction in which the plane's normal has a positive weight.
inline void addPlane(UnitSamples& samples, const UnitPlane& plane, float weight = 1.0f) {
  const Vec3f n{static_cast<float>(plane.n.x()), static_cast<float>(plane.n.y()),
                static_cast<float>(plane.n.z())};
  const DirectionSet set = directionsOf(n, true);
  for (int k = 0; k < set.count; ++k) {
    addPlaneTo(samples, set.direction[k], plane, weight * set.weight[k]);
  }
}

inline int labelsOf(const UnitPlane& plane) {
  int index = 0;
  for (int c = 0; c < kCubeCorners; ++c) index |= (plane.at(c) < 0.0f ? 1 : 0) << c;
  return index;
}

inline UnitPlane randomPlane(std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  const Eigen::Vector3d n =
      Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  return {n, n.dot(Eigen::Vector3d::Constant(0.5)) + uniform(random)};
}

}  // namespace dtsdf
