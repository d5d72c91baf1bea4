/// What a colour image paints, and what may hide that from it.
#pragma once

#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "tiles/pinhole_view.h"

namespace dtsdf {

/// Errs on the side of more.
class ColourReach {
 public:
  /// @pre colour/max_depth_m is not 0: else an image reaches without end.
  ColourReach(const MapperParams& params, const ColourRules& rules);

  /// Whether an image may paint something of these blocks.
  bool mayPaint(const PinholeView& image, const BlockExtent& blocks) const;

  /// The blocks that may have to do with how it paints them: what lies between them and the camera,
  /// and what is seen right beside or behind them, up to the depth that images reach.
  BlockExtent blocksFor(const PinholeView& image, const BlockExtent& painted) const;

 private:
  MetricBox pointsOf(const BlockExtent& blocks) const;

  const ColourRules rules_;
  const double voxel_m_, block_m_, max_depth_m_;
};

}  // namespace dtsdf
