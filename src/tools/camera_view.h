/// Tests which axis-aligned boxes may be in view of a camera, and finds the blocks that may affect
/// painting with a colour image.
#pragma once

#include <Eigen/Geometry>

#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "dtsdf_mapping/pinhole.h"
#include "map/block_extent.h"

namespace dtsdf {

/// An axis-aligned box in the map frame, in metres.
using MetricBox = Eigen::AlignedBox3d;

/// The box around blocks with edges of `block_m`, extended by a margin on each side.
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

  /// Whether any part of a box may be nearer than `depth_m` and inside the image or a few pixels
  /// outside it. May also be true for a box that is out of view.
  bool maySee(const MetricBox& box, double depth_m) const;

  Eigen::Vector3d centre() const { return T_C_W_.inverse().translation(); }
  const Intrinsics& intrinsics() const { return intrinsics_; }

 private:
  Intrinsics intrinsics_;
  int width_, height_;
  Eigen::Isometry3d T_C_W_;
};

/// Whether a depth image may change any of these blocks.
bool mayFuse(const CameraView& image, const BlockExtent& blocks, const MapperParams& params);

/// Whether a colour image may paint any of these blocks.
/// @pre colour/max_depth_m is above 0.
bool mayPaint(const CameraView& image, const BlockExtent& blocks, const MapperParams& params,
              const ColourRules& rules);

/// A box around these blocks and all blocks that may occlude part of them in a colour image.
BlockExtent blocksThatHide(const CameraView& image, const BlockExtent& blocks,
                           const MapperParams& params, const ColourRules& rules);

}  // namespace dtsdf
