/// The image of what hides, drawn row by row: drawSurface() for the cells of a row at once. Same
/// bits.
#pragma once

#include <vector>

#include "cpu/surface_points.h"
#include "kernels/colour/hiding.h"

namespace dtsdf {

/// Draws into an image of depths, whose vector it makes as large as that takes. One thread.
class HidingRows {
 public:
  /// Nothing is drawn yet. Sizes in cells; `depth_m` outlives it.
  HidingRows(std::vector<float>& depth_m, int32_t width, int32_t height);

  /// Those of the points that are listed.
  void draw(const PointView& view, const SurfacePoints& points, const int* listed, int count) const;

 private:
  float* depth_m_;
  int32_t width_;
};

}  // namespace dtsdf
