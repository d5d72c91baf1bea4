#include "scenes/plane_raster.h"

#include <algorithm>
#include <cmath>

namespace dtsdf {
namespace {

using Eigen::Vector2d;

/// Values spread evenly over [0, 1): fractional parts of multiples of the golden ratio.
double spread(int i) {
  const double multiple = 0.6180339887498949 * i;
  return multiple - std::floor(multiple);
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

PlaneRaster::PlaneRaster(const Eigen::AlignedBox2d& area, double cell_m)
    : low_(area.min()),
      cell_m_(cell_m),
      columns_(static_cast<int>(std::ceil(area.sizes().x() / cell_m))),
      rows_(static_cast<int>(std::ceil(area.sizes().y() / cell_m))),
      is_covered_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), 0) {}

Vector2d PlaneRaster::pointOf(int column, int row) const {
  return low_ + cell_m_ * Vector2d(column + spread(row), row + spread(column));
}

void PlaneRaster::cover(const Surface& surface) {
  for (const FlatTriangle& triangle : surface) cover(triangle);
}

void PlaneRaster::cover(const FlatTriangle& triangle) {
  const Vector2d a = triangle.a.head<2>();
  Vector2d b = triangle.b.head<2>(), c = triangle.c.head<2>();
  if (cross(b - a, c - a) < 0.0) std::swap(b, c);
  const Vector2d low = (a.cwiseMin(b).cwiseMin(c) - low_) / cell_m_;
  const Vector2d high = (a.cwiseMax(b).cwiseMax(c) - low_) / cell_m_;
  const int first_column = std::max(0, static_cast<int>(std::floor(low.x())));
  const int first_row = std::max(0, static_cast<int>(std::floor(low.y())));
  const int last_column = std::min(columns_ - 1, static_cast<int>(std::floor(high.x())));
  const int last_row = std::min(rows_ - 1, static_cast<int>(std::floor(high.y())));
  for (int row = first_row; row <= last_row; ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      const Vector2d p = pointOf(column, row);
      if (cross(b - a, p - a) >= 0.0 && cross(c - b, p - b) >= 0.0 && cross(a - c, p - c) >= 0.0) {
        is_covered_[static_cast<size_t>(row) * static_cast<size_t>(columns_) +
                    static_cast<size_t>(column)] = 1;
      }
    }
  }
}

double PlaneRaster::areaWhere(const std::function<bool(const Vector2d&, bool)>& holds) const {
  size_t count = 0, i = 0;
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column, ++i) {
      count += holds(pointOf(column, row), is_covered_[i] != 0) ? 1 : 0;
    }
  }
  return static_cast<double>(count) * cell_m_ * cell_m_;
}

}  // namespace dtsdf
