/// What a camera has in view of boxes along the axes of the map frame.
#pragma once

#include <Eigen/Geometry>

#include "dtsdf_mapping/pinhole.h"
#include "map/block_extent.h"

namespace dtsdf {

/// A box along the axes of the map frame, in metres.
using MetricBox = Eigen::AlignedBox3d;

/// Of blocks with this edge, and so much more to each side.
MetricBox boxOf(const BlockExtent& blocks, double block_m, double margin_m);

/// The blocks that have something of a box.
BlockExtent blocksIn(const MetricBox& box, double block_m);

/// A part of an image, in pixels from the corner of the first one.
struct PixelRect {
  double left, top, right, bottom;
};

class PinholeView {
 public:
  /// Of a depth or colour image.
  template <class Frame>
  explicit PinholeView(const Frame& frame)
      : intrinsics_(frame.intrinsics),
        width_(frame.width),
        height_(frame.height),
        T_W_C_(frame.T_W_C),
        T_C_W_(frame.T_W_C.inverse()) {}

  using Corners = Eigen::Matrix<double, 3, 8>;  ///< Of a box, in the camera's frame.
  Corners cornersOf(const MetricBox& box) const;

  /// What is seen lies between four planes through the camera; a box is not if all of it is beyond
  /// one of them by more than so many pixels, also where parts are behind the camera.
  bool isBesideImage(const Corners& corners, double margin_px) const;

  PixelRect wholeImage() const { return {0.0, 0.0, double(width_), double(height_)}; }

  /// Bounds of where a box is seen, which may go beyond the image. One that comes so near to the
  /// camera that it may be anywhere has the whole image.
  PixelRect rectOf(const Corners& corners) const;

  /// A box around all that a part of the image has in view up to a depth.
  MetricBox boundsUpTo(double depth_m, const PixelRect& rect) const;

  const Intrinsics& intrinsics() const { return intrinsics_; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  Intrinsics intrinsics_;
  int width_, height_;
  Eigen::Isometry3d T_W_C_, T_C_W_;
};

}  // namespace dtsdf
