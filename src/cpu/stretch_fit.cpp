#include "cpu/stretch_fit.h"

#include <algorithm>

namespace dtsdf {

inline int StretchFit::begin(const PixelStretch& stretch, const FitWindow& window) {
  constexpr float kLeast = 1e-6f;  // inverse depths of 0 and below have no window
  int32_t widest = 0;              // whole numbers: the largest of several is found at once
  for (int i = 0; i < stretch.pixels; ++i) {
    const float value = stretch.first.value[i];
    const int32_t radius = windowRadius(maximum(value, kLeast), window) *
                           static_cast<int32_t>(value > 0.0f);
    radius_[i] = static_cast<float>(radius);
    widest = widest > radius ? widest : radius;
    before_[i] = after_[i] = sum_y_[i] = sum_ky_[i] = 0.0f;
    sum_companion_[i] = stretch.first.companion[i];
  }
  return widest;
}

inline void StretchFit::walk(const PixelStretch& stretch, const Side& side, float* taken) {
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

void StretchFit::compute(const PixelStretch& stretch, const PixelLine& line,
                         const FitWindow& window) {
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

}  // namespace dtsdf
