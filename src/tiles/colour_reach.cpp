#include "tiles/colour_reach.h"

#include <algorithm>

#include "kernels/colour/hiding.h"

namespace dtsdf {
namespace {

/// Places in the image and distances are rounded.
constexpr double kRounding_px = 1.0, kRounding_voxels = 1.0;

}  // namespace

ColourReach::ColourReach(const MapperParams& params, const ColourRules& rules)
    : rules_(rules),
      voxel_m_(params.map.voxel_size_m),
      block_m_(voxel_m_ * kBlockSide),
      max_depth_m_(params.paint.max_depth_m) {}

/// A voxel's point is as far from it as its surface.
MetricBox ColourReach::pointsOf(const BlockExtent& blocks) const {
  const auto painted = static_cast<double>(rules_.surface_distance);
  return boxOf(blocks, block_m_, voxel_m_ * (painted + kRounding_voxels));
}

bool ColourReach::mayPaint(const PinholeView& image, const BlockExtent& blocks) const {
  const PinholeView::Corners corners = image.cornersOf(pointsOf(blocks));
  return corners.row(2).maxCoeff() > 0.0 && corners.row(2).minCoeff() <= max_depth_m_ &&
         !image.isBesideImage(corners, kRounding_px);
}

/// A point is compared with what is drawn in the cells around it: as far aside as visibilityOf()
/// looks, and a cell more. What is drawn there is a surface within that part of
/// the image, or beside it by its own radius, which drawSurface() has in pixels along both axes.
BlockExtent ColourReach::blocksFor(const PinholeView& image, const BlockExtent& painted) const {
  const PinholeView::Corners corners = image.cornersOf(pointsOf(painted));
  const Intrinsics& K = image.intrinsics();
  PixelRect rect = image.rectOf(corners);
  const double nearest_m = std::max(corners.row(2).minCoeff(), voxel_m_);
  const double beside_px =
      outlineReach(rules_, K.fx * voxel_m_ / nearest_m) + 2.0 * kCellSide + kRounding_px;
  rect.left = std::max(rect.left - beside_px, 0.0);
  rect.top = std::max(rect.top - beside_px, 0.0);
  rect.right = std::min(rect.right + beside_px, static_cast<double>(image.width()));
  rect.bottom = std::min(rect.bottom + beside_px, static_cast<double>(image.height()));
  MetricBox box = image.boundsUpTo(max_depth_m_, rect);
  const double stretch = std::max(1.0, static_cast<double>(K.fx) / static_cast<double>(K.fy));
  const double margin_m =
      voxel_m_ * (rules_.surface_distance + kPieceVoxels * stretch + kRounding_voxels);
  box.min().array() -= margin_m;
  box.max().array() += margin_m;
  return blocksIn(box, block_m_);
}

}  // namespace dtsdf
