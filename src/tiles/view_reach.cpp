#include "tiles/view_reach.h"

#include <algorithm>
#include <cmath>

#include "backend/frame_check.h"

namespace dtsdf {
namespace {

constexpr int kCell_px = 16;
/// Pixels are judged with those around them (seesThrough(), freeInGap()), and places in the image
/// are rounded.
constexpr int kMargin_px = 3;
/// A box nearer than this in front of the camera may be anywhere in the image.
constexpr double kNear_m = 0.05;

int cellsFor(int pixels) { return (pixels + kCell_px - 1) / kCell_px; }

}  // namespace

ViewReach::ViewReach(const DepthFrame& frame, const MapperParams& params)
    : frame_(frame),
      T_C_W_(frame.T_W_C.inverse()),
      columns_(cellsFor(frame.width)),
      rows_(cellsFor(frame.height)),
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
  frame_.data = nullptr;
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
  const Intrinsics& K = frame_.intrinsics;
  Eigen::Vector3d least = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d most = -least;  // u, v and depth of the box's corners
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p_W{(corner & 1 ? box.max_W : box.min_W).x(),
                              (corner & 2 ? box.max_W : box.min_W).y(),
                              (corner & 4 ? box.max_W : box.min_W).z()};
    const Eigen::Vector3d p = T_C_W_ * p_W;
    const double z = std::max(p.z(), kNear_m);
    const Eigen::Vector3d seen{K.fx * p.x() / z + K.cx + 0.5, K.fy * p.y() / z + K.cy + 0.5,
                               p.z()};
    least = least.cwiseMin(seen);
    most = most.cwiseMax(seen);
  }
  if (!(most.z() > 0.0) || least.z() > static_cast<double>(farthest_of_all_m_)) return false;
  CellSpan u{0, columns_ - 1}, v{0, rows_ - 1};
  if (least.z() > kNear_m) {
    u = cellsBetween(least.x(), most.x(), frame_.width, columns_);
    v = cellsBetween(least.y(), most.y(), frame_.height, rows_);
  }
  for (int row = v.first; row <= v.last; ++row) {
    for (int column = u.first; column <= u.last; ++column) {
      const float farthest_m = farthest_m_[row * columns_ + column];
      if (farthest_m > 0.0f && static_cast<double>(farthest_m) >= least.z()) return true;
    }
  }
  return false;
}

}  // namespace dtsdf
