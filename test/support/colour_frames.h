/// Colour images of analytic scenes.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "simulation/scene.h"

namespace dtsdf {

using Colour = std::array<uint8_t, 3>;

/// Returns the surface colour at a point in W.
using SurfaceColour = std::function<Colour(const Eigen::Vector3d& p_W)>;

/// Sinusoidal colour pattern: red varies along x and z, green along y and blue along z.
Colour wavesAt(const Eigen::Vector3d& p_W);

/// An rgb8 colour image that owns its pixels.
struct PaintedFrame {
  ColourFrame frame;
  std::vector<uint8_t> pixels;

  /// Valid until this object is moved or destroyed.
  ColourFrame view() const {
    ColourFrame copy = frame;
    copy.data = pixels.data();
    return copy;
  }
};

/// Renders an image with a horizontal field of view of 65 degrees. Each pixel is the mean of 2 x 2
/// rays. Rays that hit nothing are black.
PaintedFrame renderColour(const Scene& scene, const SurfaceColour& colour,
                          const Eigen::Isometry3d& T_W_C, int width = 160, int height = 120);

/// Moves a camera pose to the right by `offset_m`.
Eigen::Isometry3d besideCamera(const Eigen::Isometry3d& T_W_C, double offset_m);

}  // namespace dtsdf
