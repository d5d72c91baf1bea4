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
  const Corners corners = cornersOf(box);
  const double nearest_m = corners.row(2).minCoeff();
  if (!(corners.row(2).maxCoeff() > 0.0) || nearest_m > static_cast<double>(farthest_of_all_m_) ||
      isBesideImage(corners)) {
    return false;
  }
  CellSpan u{0, columns_ - 1}, v{0, rows_ - 1};
  if (nearest_m > kNear_m) {
    const Intrinsics& K = frame_.intrinsics;
    const Eigen::Array<double, 1, 8> z = corners.row(2).array();
    const Eigen::Array<double, 1, 8> at_u = K.fx * corners.row(0).array() / z + (K.cx + 0.5);
    const Eigen::Array<double, 1, 8> at_v = K.fy * corners.row(1).array() / z + (K.cy + 0.5);
    u = cellsBetween(at_u.minCoeff(), at_u.maxCoeff(), frame_.width, columns_);
    v = cellsBetween(at_v.minCoeff(), at_v.maxCoeff(), frame_.height, rows_);
  }
  for (int row = v.first; row <= v.last; ++row) {
    for (int column = u.first; column <= u.last; ++column) {
      const float farthest_m = farthest_m_[row * columns_ + column];
      if (farthest_m > 0.0f && static_cast<double>(farthest_m) >= nearest_m) return true;
    }
  }
  return false;
}

ViewReach::Corners ViewReach::cornersOf(const MetricBox& box) const {
  Corners corners;
  for (int i = 0; i < 8; ++i) {
    corners.col(i) = T_C_W_ * Eigen::Vector3d((i & 1 ? box.max_W : box.min_W).x(),
                                              (i & 2 ? box.max_W : box.min_W).y(),
                                              (i & 4 ? box.max_W : box.min_W).z());
  }
  return corners;
}

/// What is seen lies between four planes through the camera; a box is not if all of it is beyond
/// one of them, also where parts are behind the camera.
bool ViewReach::isBesideImage(const Corners& corners) const {
  const Intrinsics& K = frame_.intrinsics;
  const double left = K.cx + 0.5 + kMargin_px, right = frame_.width + 2.0 * kMargin_px - left;
  const double top = K.cy + 0.5 + kMargin_px, bottom = frame_.height + 2.0 * kMargin_px - top;
  const auto isBeyond = [&](double x, double y, double z) {
    return (Eigen::RowVector3d(x, y, z) * corners).maxCoeff() < 0.0;
  };
  return isBeyond(K.fx, 0.0, left) || isBeyond(-K.fx, 0.0, right) || isBeyond(0.0, K.fy, top) ||
         isBeyond(0.0, -K.fy, bottom);
}

}  // namespace dtsdf
