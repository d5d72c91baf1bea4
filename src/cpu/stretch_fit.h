/// The line fits of many neighbouring pixels at once: fitLine()'s walk, taken step by step for all
/// of them, which compilers turn into vector instructions. Same bits.
#pragma once

#include <algorithm>

#include "kernels/surfels/line_fit.h"

namespace dtsdf {

/// Pixels that are fitted at once, at most.
constexpr int kStretch = 64;

/// Neighbouring pixels, and what lines are fitted to, from the first one on.
struct PixelStretch {
  int pixels;  ///< kStretch at most.
  LineSamples first;
};

/// The fits of the pixels of a stretch.
class StretchFit {
 public:
  LineFit fit(int i) const {
    return {value_[i], slope_[i], mean_companion_[i], static_cast<int32_t>(count_[i])};
  }

  /// Fits lines around the pixels, along lines that reach as far as `line` says at most.
  void compute(const PixelStretch& stretch, const PixelLine& line, const FitWindow& window) {
    const int widest = begin(stretch, window);
    walk(stretch, {-line.stride, line.link, std::min(line.before, widest)}, before_);
    walk(stretch, {line.stride, line.link, std::min(line.after, widest)}, after_);
    for (int i = 0; i < stretch.pixels; ++i) {
      const LineFit fit = finishLine(stretch.first.value[i], before_[i], after_[i],
                                     {sum_y_[i], sum_ky_[i], sum_companion_[i]});
      value_[i] = fit.value;
      slope_[i] = fit.slope;
      mean_companion_[i] = fit.mean_companion;
      count_[i] = 1.0f + before_[i] + after_[i];
    }
  }

 private:
  /// The side that a walk takes.
  struct Side {
    int64_t stride;
    PixelLinks link;
    int steps;
  };

  /// @return the largest radius.
  int begin(const PixelStretch& stretch, const FitWindow& window) {
    float widest = 0.0f;
    for (int i = 0; i < stretch.pixels; ++i) {
      const float value = stretch.first.value[i];
      radius_[i] = value > 0.0f ? static_cast<float>(windowRadius(value, window)) : 0.0f;
      widest = maximum(widest, radius_[i]);
      before_[i] = after_[i] = sum_y_[i] = sum_ky_[i] = 0.0f;
      sum_companion_[i] = stretch.first.companion[i];
    }
    return static_cast<int>(widest);
  }

  void walk(const PixelStretch& stretch, const Side& side, float* taken) {
    const float* values = stretch.first.value;
    for (int i = 0; i < stretch.pixels; ++i) open_[i] = 1;
    for (int step = 1; step <= side.steps; ++step) {
      const float* current = values + step * side.stride;
      const float* companions = stretch.first.companion + step * side.stride;
      const PixelLinks* links =
          stretch.first.links + (side.stride < 0 ? step : step - 1) * side.stride;
      const float distance = static_cast<float>(step);
      const float k = side.stride < 0 ? -distance : distance;
      for (int i = 0; i < stretch.pixels; ++i) {
        LineWalk walk{open_[i], taken[i], {sum_y_[i], sum_ky_[i], sum_companion_[i]}};
        const int32_t in_reach = static_cast<int32_t>(distance <= radius_[i]);
        takeSample(walk, in_reach & continuesWalk(current[i], links[i], side.link), k,
                   current[i] - values[i], companions[i]);
        open_[i] = walk.open;
        taken[i] = walk.steps;
        sum_y_[i] = walk.sums.y;
        sum_ky_[i] = walk.sums.ky;
        sum_companion_[i] = walk.sums.companion;
      }
    }
  }

  float value_[kStretch], slope_[kStretch], mean_companion_[kStretch], count_[kStretch];
  int32_t open_[kStretch];
  float radius_[kStretch], before_[kStretch], after_[kStretch];
  float sum_y_[kStretch], sum_ky_[kStretch], sum_companion_[kStretch];
};

}  // namespace dtsdf
