#include "cpu/stretch_fit.h"

#include <algorithm>

#include "cpu/widest_vectors.h"

namespace dtsdf {

inline int StretchFit::begin(const PixelStretch& stretch, const FitWindow& window) {
  constexpr float kLeast = 1e-6f;  // inverse depths of 0 and below have no window
  int32_t widest = 0;              // whole numbers: the largest of several is found at once
  for (int i = 0; i < stretch.pixels; ++i) {
    const float value = stretch.first.value[i];
    const WindowRadius radius = windowRadius(maximum(value, kLeast), window);
    const int32_t both = radius.both * static_cast<int32_t>(value > 0.0f);
    radius_[i] = both;
    one_side_[i] = radius.one_side;
    widest = widest > both ? widest : both;
    before_open_[i] = after_open_[i] = 1;
    before_[i] = after_[i] = sum_y_[i] = sum_ky_[i] = 0.0f;
    sum_companion_[i] = stretch.first.companion[i];
  }
  return widest;
}

inline StretchFit::Side StretchFit::sideAt(const PixelStretch& stretch, const PixelLine& line,
                                           int offset) {
  const bool is_there = -line.before <= offset && offset <= line.after;
  const int64_t at = is_there ? offset * line.stride : 0;
  return {is_there ? 1 : 0, stretch.first.value + at, stretch.first.companion + at,
          stretch.first.links + (offset > 0 && is_there ? at - line.stride : at)};
}

inline void StretchFit::takeStep(const PixelStretch& stretch, const PixelLine& line, int step) {
  const Side before = sideAt(stretch, line, -step), after = sideAt(stretch, line, step);
  const float* values = stretch.first.value;
  const PixelLinks link = line.link;
  for (int i = 0; i < stretch.pixels; ++i) {
    LineWalk walk{before_open_[i],
                  after_open_[i],
                  before_[i],
                  after_[i],
                  {sum_y_[i], sum_ky_[i], sum_companion_[i]}};
    const auto in_reach = static_cast<int32_t>(step <= radius_[i]);
    const auto sample = [&](const Side& side) {
      const int32_t continues =
          in_reach & side.is_there & continuesWalk(side.value[i], side.links[i], link);
      return SideSample{continues, side.value[i] - values[i], side.companion[i]};
    };
    dtsdf::takeStep(walk, static_cast<float>(step), static_cast<int32_t>(step <= one_side_[i]),
                    sample(before), sample(after));
    before_open_[i] = walk.before_open;
    after_open_[i] = walk.after_open;
    before_[i] = walk.before;
    after_[i] = walk.after;
    sum_y_[i] = walk.sums.y;
    sum_ky_[i] = walk.sums.ky;
    sum_companion_[i] = walk.sums.companion;
  }
}

void StretchFit::compute(const PixelStretch& stretch, const PixelLine& line,
                         const FitWindow& window) {
  withWidestVectors([&] {
    const int widest = begin(stretch, window);
    for (int step = 1; step <= widest; ++step) takeStep(stretch, line, step);
    finish(stretch);
  });
}

inline void StretchFit::finish(const PixelStretch& stretch) {
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
