/// The fits of normal estimation for many neighbouring pixels at once: fitLine()'s walk, taken step
/// by step for all of them, which compilers turn into vector instructions. Same bits.
#pragma once

#include <algorithm>

#include "kernels/surfels/normal_estimation.h"

namespace dtsdf {

/// Pixels that are fitted at once, at most.
constexpr int kStretch = 64;

/// The fits of `pixels` neighbouring pixels, kStretch at most.
class StretchFit {
 public:
  LineFit fit(int i) const {
    return {value_[i], slope_[i], mean_attached_[i], static_cast<int32_t>(count_[i])};
  }

  /// Fits lines through `values` around the pixels from its first on. `stride` leads to the next
  /// sample of a walk, of which there are `before` and `after` at most to either side.
  void compute(int pixels, const float* values, const float* attached, int64_t stride, int before,
               int after, const NormalFitSettings& settings) {
    const int widest = begin(pixels, values, attached, settings);
    walk(pixels, values, attached, -stride, std::min(before, widest), -1.0f, settings, before_);
    walk(pixels, values, attached, stride, std::min(after, widest), 1.0f, settings, after_);
    for (int i = 0; i < pixels; ++i) {
      const LineFit fit =
          finishLine(values[i], before_[i], after_[i], sum_y_[i], sum_ky_[i], sum_attached_[i]);
      value_[i] = fit.value;
      slope_[i] = fit.slope;
      mean_attached_[i] = fit.mean_attached;
      count_[i] = 1.0f + before_[i] + after_[i];
    }
  }

 private:
  /// @return the largest radius.
  int begin(int pixels, const float* values, const float* attached,
            const NormalFitSettings& settings) {
    float widest = 0.0f;
    for (int i = 0; i < pixels; ++i) {
      radius_[i] =
          values[i] > 0.0f ? static_cast<float>(windowRadius(values[i], settings)) : 0.0f;
      widest = maximum(widest, radius_[i]);
      before_[i] = after_[i] = sum_y_[i] = sum_ky_[i] = 0.0f;
      sum_attached_[i] = attached[i];
    }
    return static_cast<int>(widest);
  }

  void walk(int pixels, const float* values, const float* attached, int64_t stride, int steps,
            float sign, const NormalFitSettings& settings, float* taken) {
    for (int i = 0; i < pixels; ++i) open_[i] = 1;
    for (int step = 1; step <= steps; ++step) {
      const float* current = values + step * stride;
      const float* previous = current - stride;
      const float* more = attached + step * stride;
      const float distance = static_cast<float>(step), k = sign * distance;
      for (int i = 0; i < pixels; ++i) {
        takeSample(distance, radius_[i], k, previous[i], current[i], current[i] - values[i],
                   more[i], settings.depth_jump, open_[i], taken[i], sum_y_[i], sum_ky_[i],
                   sum_attached_[i]);
      }
    }
  }

  float value_[kStretch], slope_[kStretch], mean_attached_[kStretch], count_[kStretch];
  int32_t open_[kStretch];
  float radius_[kStretch], before_[kStretch], after_[kStretch];
  float sum_y_[kStretch], sum_ky_[kStretch], sum_attached_[kStretch];
};

}  // namespace dtsdf
