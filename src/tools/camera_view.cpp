#include "tools/camera_view.h"

#include <algorithm>

#include "kernels/colour/hiding.h"

namespace dtsdf {
namespace {

/// Pixels are judged with those around them, and places in the image are rounded.
constexpr double kMargin_px = 3.0;
constexpr double kRounding_voxels = 1.0;

Eigen::Vector3d toVector(const BlockKey& key) { return Eigen::Vector3d(key.x, key.y, key.z); }

/// The blocks that have something of a box.
BlockExtent blocksIn(const MetricBox& box, double block_m) {
  const auto blockAt = [block_m](const Eigen::Vector3d& p_W) {
    const Eigen::Array3d block = (p_W.array() / block_m).floor();
    const Eigen::Array3i key = block.max(-kMaxBlockCoordinate).min(kMaxBlockCoordinate).cast<int>();
    return BlockKey{key.x(), key.y(), key.z()};
  };
  return {blockAt(box.min()), blockAt(box.max())};
}

}  // namespace

MetricBox boxOf(const BlockExtent& blocks, double block_m, double margin_m) {
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(margin_m);
  return {toVector(blocks.first) * block_m - margin,
          (toVector(blocks.last) + Eigen::Vector3d::Ones()) * block_m + margin};
}

/// What is seen lies between four planes through the camera; a box is not if all of it is beyond
/// one of them, also where parts are behind the camera.
bool CameraView::maySee(const MetricBox& box, double depth_m) const {
  Eigen::Matrix<double, 3, 8> corners;  // in the camera's frame
  for (int i = 0; i < 8; ++i) {
    corners.col(i) = T_C_W_ * box.corner(static_cast<MetricBox::CornerType>(i));
  }
  if (!(corners.row(2).maxCoeff() > 0.0) || corners.row(2).minCoeff() > depth_m) return false;
  const Intrinsics& K = intrinsics_;
  const double left = K.cx + 0.5 + kMargin_px, right = width_ + 2.0 * kMargin_px - left;
  const double top = K.cy + 0.5 + kMargin_px, bottom = height_ + 2.0 * kMargin_px - top;
  const auto isBeyond = [&](double x, double y, double z) {
    return (Eigen::RowVector3d(x, y, z) * corners).maxCoeff() < 0.0;
  };
  return !isBeyond(K.fx, 0.0, left) && !isBeyond(-K.fx, 0.0, right) && !isBeyond(0.0, K.fy, top) &&
         !isBeyond(0.0, -K.fy, bottom);
}

MetricBox CameraView::frustum(double depth_m) const {
  const Intrinsics& K = intrinsics_;
  MetricBox seen(T_W_C_.translation());
  for (int i = 0; i < 4; ++i) {
    const double u = (i & 1 ? width_ : 0) - 0.5, v = (i & 2 ? height_ : 0) - 0.5;
    seen.extend(T_W_C_ *
                Eigen::Vector3d(depth_m * (u - K.cx) / K.fx, depth_m * (v - K.cy) / K.fy, depth_m));
  }
  return seen;
}

/// A voxel is changed by what is measured as far from it as the truncation; its foot is within it.
bool mayFuse(const CameraView& image, const BlockExtent& blocks, const MapperParams& params) {
  const auto voxel_m = static_cast<double>(params.map.voxel_size_m);
  const double margin_m =
      voxel_m * (static_cast<double>(params.map.truncation_voxels) + 2.0 + kBlockSide);
  return image.maySee(boxOf(blocks, voxel_m * kBlockSide, margin_m),
                      static_cast<double>(params.fusion.max_depth_m));
}

namespace {

/// A voxel's point is as far from it as its surface.
MetricBox pointsOf(const BlockExtent& blocks, double voxel_m, const ColourRules& rules) {
  const auto painted = static_cast<double>(rules.surface_distance);
  return boxOf(blocks, voxel_m * kBlockSide, voxel_m * (painted + kRounding_voxels));
}

}  // namespace

bool mayPaint(const CameraView& image, const BlockExtent& blocks, const MapperParams& params,
              const ColourRules& rules) {
  return image.maySee(pointsOf(blocks, params.map.voxel_size_m, rules), params.max_paint_depth_m);
}

/// A point is compared with what is drawn in the image: a surface in view, or beside it by its own
/// radius, which drawSurface() has in pixels along both axes.
BlockExtent blocksThatDecide(const CameraView& image, const MapperParams& params,
                             const ColourRules& rules) {
  const double voxel_m = params.map.voxel_size_m;
  const Intrinsics& K = image.intrinsics();
  MetricBox box = image.frustum(params.max_paint_depth_m);
  const double stretch = std::max(1.0, static_cast<double>(K.fx) / static_cast<double>(K.fy));
  const double margin_m =
      voxel_m * (rules.surface_distance + kPieceVoxels * stretch + kRounding_voxels);
  box.min().array() -= margin_m;
  box.max().array() += margin_m;
  return blocksIn(box, voxel_m * kBlockSide);
}

}  // namespace dtsdf
