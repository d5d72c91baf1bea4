/// The line fits of many neighbouring pixels at once: fitLine()'s walk, taken step by step for all
/// of them, which compilers turn into vector instructions. Same bits.
#pragma once

#include "kernels/surfels/line_fit.h"

namespace dtsdf {

/// Pixels that are fitted at once, at most.
constexpr int kStretch = 64;

/// The fits of the pixels of a stretch.
class StretchFit {
 public:
  LineFit fit(int i) const {
    return {value_[i], slope_[i], mean_companion_[i], static_cast<int32_t>(count_[i])};
  }

  /// Fits lines around neighbouring pixels, up to kStretch, along lines that reach as far as `line`
  /// says at most; `first` are the samples from the first pixel on.
  void compute(int pixels, const LineSamples& first, const PixelLine& line,
               const FitWindow& window);

 private:
  /// @return the largest radius.
  int begin(int pixels, const LineSamples& first, const FitWindow& window);
  void takeStep(int pixels, const LineSamples& first, const PixelLine& line, int step);
  void finish(int pixels, const float* values);

  float value_[kStretch], slope_[kStretch], mean_companion_[kStretch], count_[kStretch];
  int32_t radius_[kStretch], one_side_[kStretch];
  int32_t before_open_[kStretch], after_open_[kStretch];
  float before_[kStretch], after_[kStretch];
  float sum_y_[kStretch], sum_ky_[kStretch], sum_companion_[kStretch];
};

}  // namespace dtsdf
