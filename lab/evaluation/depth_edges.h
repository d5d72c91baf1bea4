/// Detects where a depth image passes from one surface to another.
#pragma once

#include <cmath>

namespace dtsdf {

/// Whether a neighbour's depth belongs to another surface than the pixel's own, both in metres.
inline bool isDepthEdge(float z_m, float neighbour_m) {
  constexpr float kEdgeDepthShare = 0.03f;  // a smaller step is a slanted surface
  return std::abs(neighbour_m - z_m) > kEdgeDepthShare * z_m;
}

}  // namespace dtsdf
