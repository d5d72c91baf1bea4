/// A look at the first frames of a recording, before hours are spent on it: what is there, and what
/// of it is hardly right.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// What the first frames show. 0, negative values, NaN, infinity and 65535 are no measurement.
struct Inspection {
  size_t frames = 0;                     ///< Frames looked at.
  std::optional<size_t> images, posed;   ///< In the whole recording, as far as known.
  size_t images_passed_over = 0;         ///< Before and between the frames looked at.
  int width = 0, height = 0;             ///< Size of the first frame.
  Intrinsics intrinsics{0, 0, 0, 0};     ///< Camera of the first frame.
  double units_per_metre = 0.0;          ///< Depth units of the first frame.
  double measured_share = 0.0;           ///< Share of their pixels that measure depth.
  std::optional<double> median_depth_m;  ///< Median of what is measured.
};

/// Looks at up to `frames` frames. @return the same frames, from the first on.
/// @throws std::runtime_error as the source does.
std::unique_ptr<FrameSource> inspect(std::unique_ptr<FrameSource> source, size_t frames,
                                     Inspection& found);

/// "300 images of 640 x 480 (fx 525, fy 525, cx 319.5, cy 239.5), 298 with a pose; median depth
/// 1.92 m, 81 % of the pixels measured".
std::string describe(const Inspection& found);

/// What is implausible, each with what to look at; depths are mapped from `min_depth_m` to
/// `max_depth_m`.
std::vector<std::string> warningsAbout(const Inspection& found, double min_depth_m,
                                       double max_depth_m);

}  // namespace dtsdf
