/// Detects edges between surfaces in a depth image.
#pragma once

#include <cmath>

namespace dtsdf {

/// Whether two neighbouring pixels, with depths in metres, belong to different surfaces.
inline bool isDepthEdge(float z_m, float neighbour_m) {
  constexpr float kEdgeDepthShare = 0.03f;  // steps on slanted surfaces are smaller
  return std::abs(neighbour_m - z_m) > kEdgeDepthShare * z_m;
}

}  // namespace dtsdf
