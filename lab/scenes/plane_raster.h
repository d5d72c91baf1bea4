/// Points of a plane z = const that a surface covers, seen along z, each counted once.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "scenes/surface.h"

namespace dtsdf {

/// One point in each cell of a grid over a rectangle. Within its cell the point stands at another
/// place in each row and column, so that an edge along the grid cuts off the share that it should.
class PlaneRaster {
 public:
  PlaneRaster(const Eigen::AlignedBox2d& area, double cell_m);

  void cover(const Surface& surface);

  /// Area of the points for which the predicate, called as (x and y, whether it is covered), holds.
  /// Covered length of a line of points across the area: along x at each row, or y at each column.
  bool isCovered(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d at = (p - low_) / cell_m_;
    const int column = static_cast<int>(at.x()), row = static_cast<int>(at.y());
    return is_covered_[static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column)] != 0;
  }
  double areaWhere(const std::function<bool(const Eigen::Vector2d&, bool)>& holds) const;

 private:
  void cover(const FlatTriangle& triangle);
  Eigen::Vector2d pointOf(int column, int row) const;

  const Eigen::Vector2d low_;
  const double cell_m_;
  const int columns_, rows_;
  std::vector<uint8_t> is_covered_;  ///< Row by row.
};

}  // namespace dtsdf
