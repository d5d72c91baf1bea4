/// Lengths in cells.
#pragma once

#include <cmath>

namespace dtsdf {

/// Cells that distances of so many metres reach.
inline int reachInCells(double max_distance_m, double cell_size_m) {
  constexpr double kRounding = 1e-6;  // of floats in metres: 2 m are 25 cells of 80 mm, not 26
  return static_cast<int>(std::ceil(max_distance_m / cell_size_m * (1.0 - kRounding)));
}

}  // namespace dtsdf
