/// What the map's own surface hides from a colour camera.
///
/// The points of the surface are drawn into a small depth image, of one cell for each 4 x 4 pixels:
/// each covers its surroundings with a piece of its plane, and the nearest depth stays. A minimum
/// does not depend on the order.
#pragma once

#include "kernels/colour/surface_point.h"

namespace dtsdf {

constexpr int kCellSideLog2 = 2;
constexpr int kCellSide = 1 << kCellSideLog2;  ///< In pixels.

/// Depth of the nearest surface in each cell, in metres, row by row.
struct HidingImage {
  const float* depth_m;
  int32_t width, height;  ///< In cells.
};

/// Where there is no surface.
constexpr float kNoSurface_m = 1e30f;

DTSDF_HD int32_t cellsFor(int32_t pixels) { return (pixels + kCellSide - 1) >> kCellSideLog2; }

DTSDF_HD int32_t cellOf(float px, int32_t cells) {
  const int32_t cell = floorToInt(px) >> kCellSideLog2;
  return cell < 0 ? 0 : (cell < cells ? cell : cells - 1);
}

/// Calls draw(cell, depth_m) for the cells around a point that its surface covers.
template <class Draw>
DTSDF_HD void drawSurface(const PointView& view, const SurfacePoint& point, const Draw& draw) {
  const FrameView& frame = view.frame;
  const int32_t width = cellsFor(frame.width), height = cellsFor(frame.height);
  const float reach_px = view.rules.hiding_radius * voxelWidth(frame, point);
  const float reach_m = 2.0f * view.rules.hiding_radius * frame.voxel_size_m;
  const PointPlane plane = planeOf(frame, point);
  const int32_t last_u = cellOf(point.u + reach_px, width);
  const int32_t last_v = cellOf(point.v + reach_px, height);
  for (int32_t v = cellOf(point.v - reach_px, height); v <= last_v; ++v) {
    const float dv = (static_cast<float>(v) + 0.5f) * kCellSide - point.v;
    for (int32_t u = cellOf(point.u - reach_px, width); u <= last_u; ++u) {
      const float du = (static_cast<float>(u) + 0.5f) * kCellSide - point.u;
      const float depth_m = depthBeside(plane, du, dv);
      draw(v * width + u, minimum(maximum(depth_m, point.p_C.z - reach_m), point.p_C.z + reach_m));
    }
  }
}

/// How much nearer than the point's plane the surface is so many pixels beside it, in metres; far
/// below 0 where there is none.
DTSDF_HD float nearerBeside(const HidingImage& hiding, const SurfacePoint& point,
                            const PointPlane& plane, float du, float dv) {
  const int32_t u = cellOf(point.u + du, hiding.width), v = cellOf(point.v + dv, hiding.height);
  const float centre_u = (static_cast<float>(u) + 0.5f) * kCellSide;
  const float centre_v = (static_cast<float>(v) + 0.5f) * kCellSide;
  return depthBeside(plane, centre_u - point.u, centre_v - point.v) -
         hiding.depth_m[v * hiding.width + u];
}

/// Whether something hides the point, or has its outline beside it.
DTSDF_HD bool isHidden(const PointView& view, const HidingImage& hiding,
                       const SurfacePoint& point) {
  const PointPlane plane = planeOf(view.frame, point);
  const float limit_m = view.rules.hidden_depth * view.frame.voxel_size_m;
  const float beside = view.rules.outline_px;
  bool hidden = nearerBeside(hiding, point, plane, 0.0f, 0.0f) > limit_m;
  for (int corner = 0; corner < 4 && !hidden; ++corner) {
    hidden = nearerBeside(hiding, point, plane, corner & 1 ? beside : -beside,
                          corner & 2 ? beside : -beside) > limit_m;
  }
  return hidden;
}

/// Whether the surface ends, as the camera sees it, near a point.
DTSDF_HD bool isAtOutline(const PointView& view, const HidingImage& hiding,
                          const SurfacePoint& point) {
  const PointPlane plane = planeOf(view.frame, point);
  const float limit_m = -view.rules.outline_depth * view.frame.voxel_size_m;
  const float beside = view.rules.outline_px +
                       view.rules.outline_voxels * voxelWidth(view.frame, point);
  for (int n = 0; n < 9; ++n) {
    const auto right = static_cast<float>(n % 3 - 1), down = static_cast<float>(n / 3 - 1);
    if (n == 4) continue;
    if (nearerBeside(hiding, point, plane, right * beside, down * beside) < limit_m) return true;
  }
  return false;
}

}  // namespace dtsdf
