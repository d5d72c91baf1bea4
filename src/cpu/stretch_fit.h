/// The line fits of many neighbouring pixels at once: fitLine()'s walk, taken step by step for all
/// of them, which compilers turn into vector instructions. Same bits.
#pragma once

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
  void compute(const PixelStretch& stretch, const PixelLine& line, const FitWindow& window);

 private:
  /// The samples of all pixels at an offset, and the links that lead there.
  struct Side {
    int32_t is_there;  ///< 0 beyond the end of the line; the pointers are the centres' then.
    const float* value;
    const float* companion;
    const PixelLinks* links;
  };

  /// @return the largest radius.
  int begin(const PixelStretch& stretch, const FitWindow& window);
  static Side sideAt(const PixelStretch& stretch, const PixelLine& line, int offset);
  void takeStep(const PixelStretch& stretch, const PixelLine& line, int step);
  void finish(const PixelStretch& stretch);

  float value_[kStretch], slope_[kStretch], mean_companion_[kStretch], count_[kStretch];
  int32_t radius_[kStretch], one_side_[kStretch];
  int32_t before_open_[kStretch], after_open_[kStretch];
  float before_[kStretch], after_[kStretch];
  float sum_y_[kStretch], sum_ky_[kStretch], sum_companion_[kStretch];
};

}  // namespace dtsdf
