/// How far a depth image sees, in cells of pixels: whether its rays pass through a box.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// A box along the axes of the map frame, in metres.
struct MetricBox {
  Eigen::Vector3d min_W, max_W;
};

/// Errs on the side of yes: a box is passed by if anything of it may be seen through.
class ViewReach {
 public:
  ViewReach(const DepthFrame& frame, const MapperParams& params);

  /// Whether a ray, from the camera to what its pixel measures, may pass through the box.
  bool mayPass(const MetricBox& box) const;

 private:
  /// Cells from first to last, along one axis of the image.
  struct CellSpan {
    int first, last;
  };
  using Corners = Eigen::Matrix<double, 3, 8>;  ///< Of a box, in the camera's frame.

  Corners cornersOf(const MetricBox& box) const;
  bool isBesideImage(const Corners& corners) const;
  CellSpan cellsBetween(double min_px, double max_px, int pixels, int cells) const;

  DepthFrame frame_;  ///< Without its pixels.
  Eigen::Isometry3d T_C_W_;
  int columns_, rows_;
  std::vector<float> farthest_m_;  ///< That a cell's pixels measure; 0: nothing.
  float farthest_of_all_m_ = 0.0f;
};

}  // namespace dtsdf
