#include "tiles/pinhole_view.h"

#include <cmath>

namespace dtsdf {
namespace {

/// A box nearer than this in front of the camera may be anywhere in the image.
constexpr double kNear_m = 0.05;

Eigen::Vector3d toVector(const BlockKey& key) { return Eigen::Vector3d(key.x, key.y, key.z); }

}  // namespace

MetricBox boxOf(const BlockExtent& blocks, double block_m, double margin_m) {
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(margin_m);
  return {toVector(blocks.first) * block_m - margin,
          (toVector(blocks.last) + Eigen::Vector3d::Ones()) * block_m + margin};
}

BlockExtent blocksIn(const MetricBox& box, double block_m) {
  const auto blockAt = [block_m](const Eigen::Vector3d& p_W) {
    const Eigen::Array3d block = (p_W.array() / block_m).floor();
    const Eigen::Array3i key = block.max(-kMaxBlockCoordinate).min(kMaxBlockCoordinate).cast<int>();
    return BlockKey{key.x(), key.y(), key.z()};
  };
  return {blockAt(box.min()), blockAt(box.max())};
}

PinholeView::Corners PinholeView::cornersOf(const MetricBox& box) const {
  Corners corners;
  for (int i = 0; i < 8; ++i) {
    corners.col(i) = T_C_W_ * box.corner(static_cast<MetricBox::CornerType>(i));
  }
  return corners;
}

bool PinholeView::isBesideImage(const Corners& corners, double margin_px) const {
  const Intrinsics& K = intrinsics_;
  const double left = K.cx + 0.5 + margin_px, right = width_ + 2.0 * margin_px - left;
  const double top = K.cy + 0.5 + margin_px, bottom = height_ + 2.0 * margin_px - top;
  const auto isBeyond = [&](double x, double y, double z) {
    return (Eigen::RowVector3d(x, y, z) * corners).maxCoeff() < 0.0;
  };
  return isBeyond(K.fx, 0.0, left) || isBeyond(-K.fx, 0.0, right) || isBeyond(0.0, K.fy, top) ||
         isBeyond(0.0, -K.fy, bottom);
}

PixelRect PinholeView::rectOf(const Corners& corners) const {
  if (!(corners.row(2).minCoeff() > kNear_m)) return wholeImage();
  const Intrinsics& K = intrinsics_;
  const Eigen::Array<double, 1, 8> z = corners.row(2).array();
  const Eigen::Array<double, 1, 8> u = K.fx * corners.row(0).array() / z + (K.cx + 0.5);
  const Eigen::Array<double, 1, 8> v = K.fy * corners.row(1).array() / z + (K.cy + 0.5);
  return {u.minCoeff(), v.minCoeff(), u.maxCoeff(), v.maxCoeff()};
}

MetricBox PinholeView::boundsUpTo(double depth_m, const PixelRect& rect) const {
  const Intrinsics& K = intrinsics_;
  MetricBox box(T_W_C_.translation());
  for (int i = 0; i < 4; ++i) {
    const double u = (i & 1 ? rect.right : rect.left) - 0.5;
    const double v = (i & 2 ? rect.bottom : rect.top) - 0.5;
    const Eigen::Vector3d p_C((u - K.cx) / K.fx, (v - K.cy) / K.fy, 1.0);
    box.extend(T_W_C_ * (depth_m * p_C));
  }
  return box;
}

}  // namespace dtsdf
