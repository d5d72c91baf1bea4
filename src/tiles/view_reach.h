/// How far a depth image sees, in cells of pixels: whether its rays pass through a box.
#pragma once

#include <vector>

#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "tiles/pinhole_view.h"

namespace dtsdf {

/// Errs on the side of yes: a box is passed by if anything of it may be seen through.
class ViewReach {
 public:
  ViewReach(const DepthFrame& frame, const MapperParams& params);

  /// Whether a ray, from the camera to what its pixel measures, may pass through the box.
  bool mayPass(const MetricBox& box) const;

  /// A box around all that it sees up to a depth.
  MetricBox boundsUpTo(double depth_m) const;

 private:
  /// Cells from first to last, along one axis of the image.
  struct CellSpan {
    int first, last;
  };

  CellSpan cellsBetween(double min_px, double max_px, int pixels, int cells) const;

  PinholeView view_;
  int columns_, rows_;
  std::vector<float> farthest_m_;  ///< That a cell's pixels measure; 0: nothing.
  float farthest_of_all_m_ = 0.0f;
};

}  // namespace dtsdf
