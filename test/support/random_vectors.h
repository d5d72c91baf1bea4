/// Random vectors for tests.
#pragma once

#include <random>

#include "kernels/core/vec.h"

namespace dtsdf {

/// Returns a uniformly distributed unit vector.
inline Vec3f randomUnit(std::mt19937& random) {
  std::normal_distribution<float> normal;
  const Vec3f v{normal(random), normal(random), normal(random)};
  return (1.0f / norm(v)) * v;
}

}  // namespace dtsdf
