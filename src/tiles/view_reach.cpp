#include "tiles/view_reach.h"

#include <algorithm>
#include <cmath>

#include "backend/frame_check.h"

namespace dtsdf {
namespace {

constexpr int kCell_px = 16;
/// Pixels are judged with those around them (seesThrough(), filledInverseDepth()), and places in
/// the image are rounded.
constexpr int kMargin_px = 3;

int cellsAlong(int pixels) { return (pixels + kCell_px - 1) / kCell_px; }

}  // namespace

ViewReach::ViewReach(const DepthFrame& frame, const MapperParams& params)
    : view_(frame),
      columns_(cellsAlong(frame.width)),
      rows_(cellsAlong(frame.height)),
      farthest_m_(static_cast<size_t>(columns_) * rows_, 0.0f) {
  const DepthRange range = depthRangeOf(frame, params);
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      const float inverse_depth = std::fabs(inverseDepth(rawDepth(frame, u, v), range));
      if (!(inverse_depth > 0.0f)) continue;
      float& farthest_m = farthest_m_[(v / kCell_px) * columns_ + u / kCell_px];
      farthest_m = std::max(farthest_m, 1.0f / inverse_depth);
    }
  }
  for (const float cell_m : farthest_m_) farthest_of_all_m_ = std::max(farthest_of_all_m_, cell_m);
}

ViewReach::CellSpan ViewReach::cellsBetween(double min_px, double max_px, int pixels,
                                            int cells) const {
  if (!(max_px + kMargin_px >= 0.0) || !(min_px - kMargin_px <= pixels)) return {0, -1};
  const double first = std::floor((std::max(min_px, 0.0) - kMargin_px) / kCell_px);
  const double last =
      std::floor((std::min(max_px, static_cast<double>(pixels)) + kMargin_px) / kCell_px);
  return {std::max(static_cast<int>(first), 0), std::min(static_cast<int>(last), cells - 1)};
}

bool ViewReach::mayPass(const MetricBox& box) const {
  const PinholeView::Corners corners = view_.cornersOf(box);
  const double nearest_m = corners.row(2).minCoeff();
  if (!(corners.row(2).maxCoeff() > 0.0) || nearest_m > static_cast<double>(farthest_of_all_m_) ||
      view_.isBesideImage(corners, kMargin_px)) {
    return false;
  }
  const PixelRect rect = view_.rectOf(corners);
  const CellSpan u = cellsBetween(rect.left, rect.right, view_.width(), columns_);
  const CellSpan v = cellsBetween(rect.top, rect.bottom, view_.height(), rows_);
  for (int row = v.first; row <= v.last; ++row) {
    for (int column = u.first; column <= u.last; ++column) {
      const float farthest_m = farthest_m_[row * columns_ + column];
      if (farthest_m > 0.0f && static_cast<double>(farthest_m) >= nearest_m) return true;
    }
  }
  return false;
}

MetricBox ViewReach::boundsUpTo(double depth_m) const {
  return view_.boundsUpTo(std::min(depth_m, static_cast<double>(farthest_of_all_m_)),
                          view_.wholeImage());
}

}  // namespace dtsdf
