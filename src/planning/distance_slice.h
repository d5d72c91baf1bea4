/// Distances to surfaces in a plane across the map, cell by cell.
#pragma once

#include <vector>

#include "dtsdf_mapping/space.h"

namespace dtsdf {

/// A cell of which something is known, and the distance where the plane meets its middle.
struct SliceCell {
  Vec3i cell;
  CellState state;  ///< Never kUnknown.
  float distance_m;
};

/// The known cells at a height along z of the map frame; in no order.
std::vector<SliceCell> sliceAt(const KnownSpace& space, double height_m);

/// Where the slice meets the middle of a cell.
Eigen::Vector3d pointInSlice(const SliceCell& cell, double cell_size_m, double height_m);

}  // namespace dtsdf
