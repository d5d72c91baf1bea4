/// Measures the area that a surface covers when projected along z. Where triangles overlap, the
/// area counts once.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "scenes/surface.h"

namespace dtsdf {

/// Samples a rectangle at one point in each cell of a grid. The point's position in its cell varies
/// by row and column, so that an edge parallel to the grid cuts off the right fraction of
/// the points.
class PlaneRaster {
 public:
  PlaneRaster(const Eigen::AlignedBox2d& area, double cell_m);

  void cover(const Surface& surface);

  /// Total area of the cells for whose point p `holds(p, is_covered)` returns true.
  double areaWhere(const std::function<bool(const Eigen::Vector2d&, bool)>& holds) const;

 private:
  void cover(const FlatTriangle& triangle);
  Eigen::Vector2d pointOf(int column, int row) const;

  const Eigen::Vector2d low_;
  const double cell_m_;
  const int columns_, rows_;
  std::vector<uint8_t> is_covered_;  ///< In row-major order.
};

}  // namespace dtsdf
