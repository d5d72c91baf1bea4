/// Finds surface points that are hidden from a colour camera by other parts of the map.
///
/// The surface points of voxels for which hides() holds are drawn into a depth image with one cell
/// per 2 x 2 pixels. Each point is drawn as a piece of its plane. A cell keeps the nearest depth,
/// so the order of drawing does not matter.
#pragma once

#include "kernels/colour/surface_point.h"

namespace dtsdf {

constexpr int kCellSideLog2 = 1;
constexpr int kCellSide = 1 << kCellSideLog2;  ///< In pixels.

/// Depth of cells without a surface.
constexpr float kNoSurface_m = 1e30f;

DTSDF_HD int32_t cellsFor(int32_t pixels) { return (pixels + kCellSide - 1) >> kCellSideLog2; }

/// The cell of a pixel coordinate, clamped to the image. With extreme intrinsics, `px` may not fit
/// in an integer.
DTSDF_HD int32_t cellOf(float px, int32_t cells) {
  constexpr float kMaxPixelCoordinate = 16777216.0f;
  const int32_t cell = floorToInt(minimum(maximum(px, 0.0f), kMaxPixelCoordinate)) >> kCellSideLog2;
  return cells > cell ? cell : cells - 1;
}

/// Whether a voxel hides points behind it. Its surface must be near, and lie between the voxel and
/// the next voxel along the direction's axis. Unless that next voxel is in another block, it must
/// have enough evidence too, so that isolated noise does not hide the surfaces behind. In the
/// undirected map, which has no axis, a near surface suffices.
DTSDF_HD bool hides(const PointView& view, const Voxel* voxels, int index, int direction) {
  if (!isNearSurface(view, voxels[index])) return false;
  if (!view.directional) return true;
  const int axis = directionAxis(direction);
  const bool is_behind = sdfOf(voxels[index]) < 0.0f;
  const bool upwards = (directionSign(direction) > 0.0f) == is_behind;
  const int at = component(voxelOffset(index), axis) + (upwards ? 1 : -1);
  if (at < 0 || at >= kBlockSide) return true;
  const int step = axis == 0 ? 1 : (axis == 1 ? kBlockSide : kBlockSide * kBlockSide);
  const Voxel& next = voxels[index + (upwards ? step : -step)];
  return evidenceOf(next) >= view.min_evidence && (sdfOf(next) < 0.0f) != is_behind;
}

/// Points are a voxel apart, so a point's piece of the surface extends half a voxel to each side.
constexpr float kPieceVoxels = 0.5f;

/// The piece of the surface around a point.
struct SurfacePiece {
  SurfacePoint point;
  float nearest_m, last_m;  ///< Range of the piece's depths.
  float reach_m;
  int32_t own_u, own_v;                      ///< The point's cell.
  int32_t first_u, last_u, first_v, last_v;  ///< Cells it may cover.
};

DTSDF_HD SurfacePiece pieceOf(const PointView& view, const SurfacePoint& point) {
  const FrameView& frame = view.frame;
  const int32_t width = cellsFor(frame.width), height = cellsFor(frame.height);
  const float reach_px = kPieceVoxels * voxelWidth(frame, point);
  const float reach_m = frame.voxel_size_m;
  SurfacePiece piece;
  piece.point = point;
  piece.nearest_m = maximum(point.depth_m - reach_m, 0.0f);  // depths are compared by their bits
  piece.last_m = point.depth_m + reach_m;
  piece.reach_m = reach_m;
  piece.own_u = cellOf(point.u, width);
  piece.own_v = cellOf(point.v, height);
  piece.first_u = cellOf(point.u - reach_px, width);
  piece.last_u = cellOf(point.u + reach_px, width);
  piece.first_v = cellOf(point.v - reach_px, height);
  piece.last_v = cellOf(point.v + reach_px, height);
  return piece;
}

/// Depth of a point's plane in a cell.
DTSDF_HD float depthInCell(const SurfacePoint& point, int32_t u, int32_t v) {
  const float centre_u = (static_cast<float>(u) + 0.5f) * kCellSide;
  const float centre_v = (static_cast<float>(v) + 0.5f) * kCellSide;
  return depthBeside(point, centre_u - point.u, centre_v - point.v);
}

/// Depth of a piece in cell (u, v), or kNoSurface_m if the piece does not cover the cell. A piece
/// covers its point's cell and the cells where its plane is within a voxel of the point's depth. At
/// a grazing angle, a larger piece would hide the surface behind it.
DTSDF_HD float depthOfPiece(const SurfacePiece& piece, int32_t u, int32_t v) {
  const float depth_m = depthInCell(piece.point, u, v);
  const bool is_own = (u == piece.own_u) & (v == piece.own_v);
  const bool is_beside = fabsf(depth_m - piece.point.depth_m) > piece.reach_m;
  const float of_piece_m = minimum(maximum(depth_m, piece.nearest_m), piece.last_m);
  return is_beside & !is_own ? kNoSurface_m : of_piece_m;
}

/// Calls draw(cell, depth_m) for each cell that the piece around a point covers.
template <class Draw>
DTSDF_HD void drawSurface(const PointView& view, const SurfacePoint& point, const Draw& draw) {
  const int32_t width = cellsFor(view.frame.width);
  const SurfacePiece piece = pieceOf(view, point);
  for (int32_t v = piece.first_v; v <= piece.last_v; ++v) {
    for (int32_t u = piece.first_u; u <= piece.last_u; ++u) {
      const float depth_m = depthOfPiece(piece, u, v);
      if (depth_m < kNoSurface_m) draw(v * width + u, depth_m);
    }
  }
}

/// Whether a nearer surface hides a point: the nearest depth in the point's cell must be less, by
/// more than hidden_depth, than both the point's depth and its plane's depth at the cell's centre.
/// `hiding_m` holds the nearest depth of each cell in metres, in row-major order.
DTSDF_HD bool isHidden(const PointView& view, const float* hiding_m, const SurfacePoint& point) {
  const int32_t width = cellsFor(view.frame.width), height = cellsFor(view.frame.height);
  const int32_t u = cellOf(point.u, width), v = cellOf(point.v, height);
  const float limit_m = view.rules.hidden_depth * view.frame.voxel_size_m;
  const float farthest_m = hiding_m[v * width + u] + limit_m;
  return farthest_m < point.depth_m && farthest_m < depthInCell(point, u, v);
}

}  // namespace dtsdf
