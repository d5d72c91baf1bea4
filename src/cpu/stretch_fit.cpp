#include "cpu/stretch_fit.h"

#include "cpu/widest_vectors.h"

namespace dtsdf {

inline int StretchFit::begin(int pixels, const LineSamples& first, const FitWindow& window) {
  constexpr float kMin = 1e-6f;  // inverse depths of 0 and below have no window
  int32_t widest = 0;            // an integer, so that compilers can vectorise the maximum
  for (int i = 0; i < pixels; ++i) {
    const float value = first.value[i];
    const WindowRadius radius = windowRadius(maximum(value, kMin), window);
    const int32_t both = radius.both * static_cast<int32_t>(value > 0.0f);
    radius_[i] = both;
    one_side_[i] = radius.one_side;
    widest = widest > both ? widest : both;
    before_open_[i] = after_open_[i] = 1;
    before_[i] = after_[i] = sum_y_[i] = sum_ky_[i] = 0.0f;
    sum_second_[i] = first.second_value[i];
  }
  return widest;
}

inline void StretchFit::takeStep(int pixels, const LineSamples& first, const PixelLine& line,
                                 int step) {
  // The samples `step` pixels before and after each centre, or the centre itself beyond the ends of
  // the line.
  const int32_t has_before = step <= line.before ? 1 : 0, has_after = step <= line.after ? 1 : 0;
  const int64_t to_before = -has_before * step * line.stride;
  const int64_t to_after = has_after * step * line.stride;
  const LineSamples before{first.value + to_before, first.second_value + to_before,
                           first.links + to_before};
  const LineSamples after{first.value + to_after, first.second_value + to_after,
                          first.links + (to_after - has_after * line.stride)};
  const float* values = first.value;
  const PixelLinks link = line.link;
  for (int i = 0; i < pixels; ++i) {
    LineWalk walk{before_open_[i], after_open_[i], before_[i],    after_[i],
                  sum_y_[i],       sum_ky_[i],     sum_second_[i]};
    const auto in_reach = static_cast<int32_t>(step <= radius_[i]);
    const auto sample = [&](const LineSamples& side, int32_t is_there) {
      const int32_t continues =
          in_reach & is_there & continuesWalk(side.value[i], side.links[i], link);
      return SideSample{continues, side.value[i] - values[i], side.second_value[i]};
    };
    dtsdf::takeStep(walk, static_cast<float>(step), static_cast<int32_t>(step <= one_side_[i]),
                    sample(before, has_before), sample(after, has_after));
    before_open_[i] = walk.before_open;
    after_open_[i] = walk.after_open;
    before_[i] = walk.before;
    after_[i] = walk.after;
    sum_y_[i] = walk.y;
    sum_ky_[i] = walk.ky;
    sum_second_[i] = walk.second_value;
  }
}

void StretchFit::compute(int pixels, const LineSamples& first, const PixelLine& line,
                         const FitWindow& window) {
  withWidestVectors([&] {
    const int widest = begin(pixels, first, window);
    for (int step = 1; step <= widest; ++step) takeStep(pixels, first, line, step);
    finish(pixels, first.value);
  });
}

inline void StretchFit::finish(int pixels, const float* values) {
  for (int i = 0; i < pixels; ++i) {
    const LineFit fit =
        finishLine(values[i], {0, 0, before_[i], after_[i], sum_y_[i], sum_ky_[i], sum_second_[i]});
    value_[i] = fit.value;
    slope_[i] = fit.slope;
    mean_second_[i] = fit.mean_second;
    count_[i] = 1.0f + before_[i] + after_[i];
  }
}

}  // namespace dtsdf
