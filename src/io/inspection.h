/// Inspects the first frames of a recording before a long run: what they contain, and what is
/// implausible.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// Figures of the first frames. 0, negative values, NaN, infinity and 65535 do not count as
/// measured.
struct Inspection {
  size_t frames = 0;                     ///< Frames that were inspected.
  std::optional<size_t> images, posed;   ///< In the whole recording, if known.
  size_t images_passed_over = 0;         ///< Skipped before and between these frames.
  int width = 0, height = 0;             ///< Size of the first frame.
  Intrinsics intrinsics{0, 0, 0, 0};     ///< Camera of the first frame.
  double units_per_metre = 0.0;          ///< Depth units of the first frame.
  double measured_share = 0.0;           ///< Share of pixels with a depth.
  std::optional<double> median_depth_m;  ///< Median of the measured depths.
};

/// Inspects up to `frames` frames. @return a source that begins with the same frames.
/// @throws std::runtime_error as the source does.
std::unique_ptr<FrameSource> inspect(std::unique_ptr<FrameSource> source, size_t frames,
                                     Inspection& found);

/// "300 images of 640 x 480 (fx 525, fy 525, cx 319.5, cy 239.5), 298 with a pose; median depth
/// 1.92 m, 81 % of the pixels measured".
std::string describe(const Inspection& found);

/// What is implausible, each with what to check; the mapped range is `min_depth_m` to
/// `max_depth_m`.
std::vector<std::string> warningsAbout(const Inspection& found, double min_depth_m,
                                       double max_depth_m);

}  // namespace dtsdf
