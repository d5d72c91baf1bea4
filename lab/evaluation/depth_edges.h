/// Detects where a depth image passes from one surface to another.
#pragma once

#include <cmath>

namespace dtsdf {

/// Whether a pixel and its neighbour, with depths in metres, show different surfaces.
inline bool isDepthEdge(float z_m, float neighbour_m) {
  constexpr float kEdgeDepthShare = 0.03f;  // slanted surfaces have smaller steps
  return std::abs(neighbour_m - z_m) > kEdgeDepthShare * z_m;
}

}  // namespace dtsdf
