/// Fits lines around many neighbouring pixels at once. Each step of fitLine() is done for all
/// pixels in a loop that compilers vectorise. The lines equal those of fitLine() bit for bit.
#pragma once

#include "kernels/surfels/line_fit.h"

namespace dtsdf {

/// Maximum number of pixels that are fitted at once.
constexpr int kStretch = 64;

class StretchFit {
 public:
  LineFit fit(int i) const {
    return {value_[i], slope_[i], mean_second_[i], static_cast<int32_t>(count_[i])};
  }

  /// Fits lines around neighbouring pixels, each at most as long as `line`.
  /// @param pixels At most kStretch.
  /// @param first Points to the samples of the first pixel.
  void compute(int pixels, const LineSamples& first, const PixelLine& line,
               const FitWindow& window);

 private:
  /// Initialises the fits. @return the largest window radius.
  int begin(int pixels, const LineSamples& first, const FitWindow& window);
  void takeStep(int pixels, const LineSamples& first, const PixelLine& line, int step);
  void finish(int pixels, const float* values);

  float value_[kStretch], slope_[kStretch], mean_second_[kStretch], count_[kStretch];
  int32_t radius_[kStretch], one_side_[kStretch];
  int32_t before_open_[kStretch], after_open_[kStretch];
  float before_[kStretch], after_[kStretch];
  float sum_y_[kStretch], sum_ky_[kStretch], sum_second_[kStretch];
};

}  // namespace dtsdf
