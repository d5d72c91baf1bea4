/// A noise-free depth image of an analytic surface, with the links between pixels (links.h) and the
/// lines fitted to rows (line_fit.h), as input for pixel kernels.
#pragma once

#include <functional>
#include <vector>

#include "kernels/surfels/line_fit.h"
#include "support/links_of_image.h"

namespace dtsdf {

/// Returns the depth z in metres of the surface point in direction (x, y, 1), or 0 if there is
/// none.
using Surface = std::function<double(double x, double y)>;

/// The plane n^T P = delta.
inline Surface plane(double nx, double ny, double nz, double delta) {
  return [=](double x, double y) { return delta / (nx * x + ny * y + nz); };
}

/// View of a camera at the origin without rotation.
inline FrameView frontalFrame(int width, int height, const Intrinsics& K, float voxel_size_m) {
  return {width, height, K, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, {0, 0, 0}, voxel_size_m};
}

class SurfaceImage {
 public:
  SurfaceImage(const Surface& surface, const FrameView& frame, const SurfelSettings& surfels,
               float sigma = 0.0f)
      : frame_(frame), noise_{sigma, surfels.noise_in_depth} {
    const Intrinsics& K = frame.intrinsics;
    for (int v = 0; v < frame.height; ++v) {
      for (int u = 0; u < frame.width; ++u) {
        const double z = surface((u - double(K.cx)) / K.fx, (v - double(K.cy)) / K.fy);
        inverse_depth_.push_back(z > 0.0 ? static_cast<float>(1.0 / z) : 0.0f);
      }
    }
    links_ = linksOfImage(frame, inverse_depth_, noise_, surfels);
    const FitWindow window = fitWindow(frame, noise_, surfels);
    for (int v = 0; v < frame.height; ++v) {
      for (int u = 0; u < frame.width; ++u) {
        const LineFit row = fitRow(inverse_depth_.data() + v * frame.width,
                                   links_.data() + v * frame.width, frame.width, u, window);
        row_value_.push_back(row.value);
        row_slope_.push_back(row.slope);
      }
    }
  }

  FrameSensing sensing() const {
    return {{frame_, inverse_depth_.data(), row_value_.data(), row_slope_.data(), links_.data()},
            noise_,
            nullptr};
  }

 private:
  FrameView frame_;
  DepthNoise noise_;
  std::vector<float> inverse_depth_, row_value_, row_slope_;
  std::vector<PixelLinks> links_;
};

}  // namespace dtsdf
