#include "support/colour_frames.h"

#include <cmath>

namespace dtsdf {
namespace {

Eigen::Vector3d seenAlong(const Scene& scene, const SurfaceColour& colour,
                          const Eigen::Vector3d& eye_W, const Eigen::Vector3d& direction_W) {
  const double s = scene.intersect(eye_W, direction_W);
  if (!std::isfinite(s)) return Eigen::Vector3d::Zero();
  const Colour seen = colour(eye_W + s * direction_W);
  return {static_cast<double>(seen[0]), static_cast<double>(seen[1]), static_cast<double>(seen[2])};
}

}  // namespace

Colour wavesAt(const Eigen::Vector3d& p_W) {
  const auto channel = [](double x) { return static_cast<uint8_t>(128.0 + 90.0 * std::sin(x)); };
  return {channel(9.0 * p_W.x() + p_W.z()), channel(8.0 * p_W.y()), channel(11.0 * p_W.z())};
}

PaintedFrame renderColour(const Scene& scene, const SurfaceColour& colour,
                          const Eigen::Isometry3d& T_W_C, int width, int height) {
  PaintedFrame result;
  ColourFrame& frame = result.frame;
  const float focal_px = 0.785f * static_cast<float>(width);
  frame.width = width;
  frame.height = height;
  frame.row_bytes = 3 * static_cast<size_t>(width);
  frame.intrinsics = {focal_px, focal_px, 0.5f * static_cast<float>(width - 1),
                      0.5f * static_cast<float>(height - 1)};
  frame.T_W_C = T_W_C;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const double du : {-0.25, 0.25}) {
        for (const double dv : {-0.25, 0.25}) {
          const Eigen::Vector3d direction_C((u + du - frame.intrinsics.cx) / focal_px,
                                            (v + dv - frame.intrinsics.cy) / focal_px, 1.0);
          sum += seenAlong(scene, colour, T_W_C.translation(), T_W_C.linear() * direction_C);
        }
      }
      for (int i = 0; i < 3; ++i) {
        result.pixels.push_back(static_cast<uint8_t>(std::lround(0.25 * sum[i])));
      }
    }
  }
  return result;
}

Eigen::Isometry3d besideCamera(const Eigen::Isometry3d& T_W_C, double offset_m) {
  return T_W_C * Eigen::Translation3d(offset_m, 0.0, 0.0);
}

}  // namespace dtsdf
