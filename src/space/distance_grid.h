/// Distances on a grid of points, optionally with parts of the map treated as free, for planning
/// with robot arms.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/region.h"
#include "space/space_follower.h"

namespace dtsdf {

/// Maximum number of points in a grid and, with cleared regions, of cells in its box.
constexpr size_t kMaxGridPoints = size_t{1} << 21;

/// A grid of points along the axes of a box, centred in the box.
struct PointGrid {
  Eigen::Isometry3d T_W_G = Eigen::Isometry3d::Identity();  ///< Point (0, 0, 0) is G's origin.
  std::array<uint32_t, 3> size{};
  double resolution_m = 0.0;

  size_t count() const { return size_t{size[0]} * size[1] * size[2]; }
};

/// The grid that fills a box. @pre The box is valid, see findProblem().
/// @throws std::runtime_error if there are too many points or the resolution is not positive.
PointGrid gridIn(const BoxRegion& box, double resolution_m);

/// Distances at the points of a grid, x varying fastest, and their gradients; NaN in unknown cells.
struct GridDistances {
  std::vector<float> distances_m;
  std::vector<float> gradients;  ///< Three per point, along the axes of F in distancesOn().
};
GridDistances distancesOn(const PointGrid& grid, const KnownSpace& space,
                          const Eigen::Matrix3d& R_F_W);

/// A copy of `space` in and around a box, in which all cells with centres in `cleared` are free.
/// Cells far from the box are unknown. @pre The regions are valid, see findProblem().
/// @throws std::runtime_error if the box is too large or exceeds a map's range of coordinates.
SpaceSnapshot clearedIn(const BoxRegion& box, const std::vector<Region>& cleared,
                        const SpaceSnapshot& space);

}  // namespace dtsdf
