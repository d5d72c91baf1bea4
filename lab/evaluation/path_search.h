/// The shortest way through a map's cells: A*, as planners of robots do it.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "dtsdf_mapping/space.h"
#include "planning/ground_grid.h"

namespace dtsdf {

/// Which cells a robot may pass.
struct Passage {
  double radius_m;               ///< Surfaces have to be farther than this.
  bool through_unknown;          ///< Whether it may pass cells of which nothing is known.
  Eigen::AlignedBox3d bounds_W;  ///< It stays within; finite.

  bool allows(const Space& space, const Vec3i& cell) const;
};

/// The columns of a grid for level ground that a robot may stand in: the same for those who know no
/// more than that grid.
class GroundPassage {
 public:
  /// `heights` are those that the robot reaches through.
  GroundPassage(Space& space, const GroundHeights& heights, const Passage& passage);

  bool allows(const Vec3i& column) const;

 private:
  int8_t valueAt(int32_t x, int32_t y) const;

  Passage passage_;
  double cell_size_m_;
  GridBox box_;  ///< The columns within the passage's bounds.
  std::vector<int8_t> values_;
};

struct Path {
  std::vector<Eigen::Vector3d> points_W;  ///< Middles of cells, from start to goal.
  double length_m = 0.0;
};

/// From cell to cell through faces, edges and corners. None: there is no way.
/// @pre Distances are up to date.
std::optional<Path> findPath(const Space& space, const Eigen::Vector3d& start_W,
                             const Eigen::Vector3d& goal_W, const Passage& passage);

/// The same over the columns of a grid, at the height of the start.
std::optional<Path> findPath(const Space& space, const Eigen::Vector3d& start_W,
                             const Eigen::Vector3d& goal_W, const GroundPassage& passage);

}  // namespace dtsdf
