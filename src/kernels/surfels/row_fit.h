/// The first half of a plane fit: a line along the row, which the columns then pass over.
#pragma once

#include "kernels/surfels/line_fit.h"

namespace dtsdf {

/// What the row pass leaves for the column pass, one image each.
struct RowFit {
  float value;  ///< Fitted inverse depth; 0 where there is none, or no slope.
  float slope;
};

DTSDF_HD RowFit rowFitOf(const LineFit& fit) {
  return fit.count < 2 ? RowFit{0.0f, 0.0f} : RowFit{fit.value, fit.slope};
}

/// The fit around pixel u of a row of inverse depths.
DTSDF_HD RowFit fitRow(const float* row, const PixelLinks* links, int width, int u,
                       const FitWindow& window) {
  const float* centre = row + u;
  if (!(*centre > 0.0f)) return {0.0f, 0.0f};
  const PixelLine line = rowAround(u, width, windowRadius(*centre, window));
  return rowFitOf(fitLine({centre, centre, links + u}, line));
}

}  // namespace dtsdf
