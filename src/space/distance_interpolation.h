/// Distances at points, between the middles of cells.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "dtsdf_mapping/space.h"
#include "kernels/space/cells.h"

namespace dtsdf {

/// The eight cells whose middles are around a point, and their shares: what trilinear interpolation
/// takes. Cell i of them is `low` + (i & 1, i >> 1 & 1, i >> 2).
struct CellsAround {
  Vec3i low;
  double share[3];  ///< Of the upper ones, per axis.

  Vec3i cell(int i) const { return low + Vec3i{i & 1, i >> 1 & 1, i >> 2}; }
};

/// In what units distances are.
struct DistanceUnits {
  double cell_size_m;
  int reach;  ///< In cells.
};

/// None for points that are not finite, or beyond the coordinates of a map.
std::optional<CellsAround> cellsAround(const Eigen::Vector3d& p_W, const DistanceUnits& units);

/// Where nothing is known, nor near.
SpaceDistance unknownDistance(const DistanceUnits& units);

/// @param squared Squared distances of the cells around, in cells; -1: beyond reach.
/// @param known Whether anything is known of the cell that the point is in.
SpaceDistance interpolate(const CellsAround& around, const int (&squared)[8], bool known,
                          const DistanceUnits& units);

}  // namespace dtsdf
