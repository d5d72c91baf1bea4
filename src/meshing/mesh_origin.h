/// What the vertices of a mesh count from: one rule for meshes as a whole and in pieces.
#pragma once

#include <array>
#include <cmath>

#include "map/block_extent.h"

namespace dtsdf {

/// The origin of W for what lies within 64 m of it, else the middle, in whole metres: see Mesh.
inline std::array<double, 3> originOf(const BlockExtent& bounds, double voxel_size_m) {
  constexpr double kNear_m = 64.0;  // floats are 0.008 mm apart there
  const double block_m = kBlockSide * voxel_size_m;
  std::array<double, 3> middle_m = {0.0, 0.0, 0.0};
  bool is_near = true;
  for (int axis = 0; axis < 3 && !holdsNone(bounds); ++axis) {
    const double low_m = block_m * component(bounds.first, axis);
    const double high_m = block_m * (component(bounds.last, axis) + 1.0);
    is_near = is_near && low_m >= -kNear_m && high_m <= kNear_m;
    middle_m[static_cast<size_t>(axis)] = std::round(0.5 * (low_m + high_m));
  }
  return is_near ? std::array<double, 3>{0.0, 0.0, 0.0} : middle_m;
}

/// A position in W, as a mesh with this origin has it.
inline Vec3f positionFrom(const std::array<double, 3>& origin_m, const std::array<double, 3>& p_W) {
  return {static_cast<float>(p_W[0] - origin_m[0]), static_cast<float>(p_W[1] - origin_m[1]),
          static_cast<float>(p_W[2] - origin_m[2])};
}

}  // namespace dtsdf
