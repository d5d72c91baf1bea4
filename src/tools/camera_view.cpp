#include "tools/camera_view.h"

#include <algorithm>

#include "kernels/colour/hiding.h"

namespace dtsdf {
namespace {

/// Allowances for the neighbours of a pixel, and for rounding.
constexpr double kMargin_px = 3.0;
constexpr double kRounding_voxels = 1.0;

Eigen::Vector3d toVector(const BlockKey& key) { return Eigen::Vector3d(key.x, key.y, key.z); }

}  // namespace

MetricBox boxOf(const BlockExtent& blocks, double block_m, double margin_m) {
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(margin_m);
  return {toVector(blocks.first) * block_m - margin,
          (toVector(blocks.last) + Eigen::Vector3d::Ones()) * block_m + margin};
}

/// The view frustum lies between four planes through the camera. A box entirely outside one of the
/// planes is out of view, even if part of the box is behind the camera.
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

/// A frame changes voxels within the truncation distance of its measurements, or of mapped surfaces
/// in front of them.
bool mayFuse(const CameraView& image, const BlockExtent& blocks, const MapperParams& params) {
  const auto voxel_m = static_cast<double>(params.map.voxel_size_m);
  const double margin_m =
      voxel_m * (static_cast<double>(params.map.truncation_voxels) + 2.0 + kBlockSide);
  return image.maySee(boxOf(blocks, voxel_m * kBlockSide, margin_m),
                      static_cast<double>(params.fusion.max_depth_m));
}

namespace {

/// A voxel takes the colour of the nearest point on its surface, which is at most surface_distance
/// away.
MetricBox pointsOf(const BlockExtent& blocks, double voxel_m, const ColourRules& rules) {
  const auto painted = static_cast<double>(rules.surface_distance);
  return boxOf(blocks, voxel_m * kBlockSide, voxel_m * (painted + kRounding_voxels));
}

}  // namespace

bool mayPaint(const CameraView& image, const BlockExtent& blocks, const MapperParams& params,
              const ColourRules& rules) {
  return image.maySee(pointsOf(blocks, params.map.voxel_size_m, rules), params.max_paint_depth_m);
}

/// A piece of surface may occlude a point if the ray from the camera to the point passes within the
/// radius of the piece plus a cell of the depth image. pieceOf() computes the radius in pixels from
/// fx, but uses this radius along both axes.
BlockExtent blocksThatHide(const CameraView& image, const BlockExtent& blocks,
                           const MapperParams& params, const ColourRules& rules) {
  const double voxel_m = params.map.voxel_size_m, block_m = voxel_m * kBlockSide;
  const double fx = image.intrinsics().fx, min_f = std::min<double>(fx, image.intrinsics().fy);
  const double piece_voxels = 2.0 * kPieceVoxels * fx / min_f;
  const double margin_m =
      voxel_m * (2.0 * rules.surface_distance + piece_voxels + 2.0 * kRounding_voxels) +
      kMargin_px * params.max_paint_depth_m / min_f;
  const MetricBox box = boxOf(blocks, block_m, 0.0).extend(image.centre());
  const auto blockAt = [block_m](const Eigen::Array3d& p_W) {
    const Eigen::Array3d block = (p_W / block_m).floor();
    const Eigen::Array3i key = block.max(-kMaxBlockCoordinate).min(kMaxBlockCoordinate).cast<int>();
    return BlockKey{key.x(), key.y(), key.z()};
  };
  return {blockAt(box.min().array() - margin_m), blockAt(box.max().array() + margin_m)};
}

}  // namespace dtsdf
