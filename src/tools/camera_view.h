/// Which boxes along the axes of the map frame a camera may see, and which blocks may affect how a
/// colour image paints.
#pragma once

#include <Eigen/Geometry>

#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "dtsdf_mapping/pinhole.h"
#include "map/block_extent.h"

namespace dtsdf {

/// A box along the axes of the map frame, in metres.
using MetricBox = Eigen::AlignedBox3d;

/// The box around blocks with edge `block_m`, with a margin on each side.
MetricBox boxOf(const BlockExtent& blocks, double block_m, double margin_m);

class CameraView {
 public:
  /// View of a depth or colour image.
  template <class Frame>
  explicit CameraView(const Frame& frame)
      : intrinsics_(frame.intrinsics),
        width_(frame.width),
        height_(frame.height),
        T_C_W_(frame.T_W_C.inverse()) {}

  /// Whether any part of a box may lie within a depth and within the image, plus a few pixels
  /// around it. Errs on the side of yes.
  bool maySee(const MetricBox& box, double depth_m) const;

  Eigen::Vector3d centre() const { return T_C_W_.inverse().translation(); }
  const Intrinsics& intrinsics() const { return intrinsics_; }

 private:
  Intrinsics intrinsics_;
  int width_, height_;
  Eigen::Isometry3d T_C_W_;
};

/// Whether a depth image may change any of these blocks: measurements up to fusion/max_depth_m
/// change voxels around them.
bool mayFuse(const CameraView& image, const BlockExtent& blocks, const MapperParams& params);

/// Whether a colour image may paint any of these blocks.
/// @pre colour/max_depth_m is not 0, which would be no limit.
bool mayPaint(const CameraView& image, const BlockExtent& blocks, const MapperParams& params,
              const ColourRules& rules);

/// The blocks that may hide a part of these from a colour image, and these.
BlockExtent blocksThatHide(const CameraView& image, const BlockExtent& blocks,
                           const MapperParams& params, const ColourRules& rules);

}  // namespace dtsdf
