/// An exact depth image of an analytic surface, with its row fits: what the rules on pixels work on.
#pragma once

#include <functional>
#include <vector>

#include "kernels/surfels/normal_estimation.h"

namespace dtsdf {

/// Depth along the optical axis of a surface at a viewing direction (x, y, 1), in metres; 0: none.
using Surface = std::function<double(double x, double y)>;

/// Points with n^T P = delta.
inline Surface plane(double nx, double ny, double nz, double delta) {
  return [=](double x, double y) { return delta / (nx * x + ny * y + nz); };
}

class SurfaceImage {
 public:
  SurfaceImage(const Surface& surface, int width, int height, const Intrinsics& K,
               const NormalFitSettings& fit) {
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const double z = surface((u - double(K.cx)) / K.fx, (v - double(K.cy)) / K.fy);
        inverse_depth_.push_back(z > 0.0 ? static_cast<float>(1.0 / z) : 0.0f);
      }
    }
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const RowFit row = fitRow(inverse_depth_.data(), width, u, v, fit);
        row_value_.push_back(row.value);
        row_slope_.push_back(row.slope);
      }
    }
  }

  FitImages images() const {
    return {inverse_depth_.data(), row_value_.data(), row_slope_.data()};
  }

 private:
  std::vector<float> inverse_depth_, row_value_, row_slope_;
};

}  // namespace dtsdf
