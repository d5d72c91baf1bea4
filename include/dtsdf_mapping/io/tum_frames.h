/// Depth frames of a TUM RGB-D folder behind the FrameSource seam.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// A folder in the format of the TUM RGB-D benchmark, and what is read of it.
struct TumOptions {
  std::string folder;               ///< Has depth.txt, groundtruth.txt and camera_info.yaml.
  double units_per_metre = 5000.0;  ///< Of the 16-bit depth images; > 0.
  double pose_tolerance_s = 0.02;   ///< The pose nearest in time may be this far from an image.
  FrameSelection selection;         ///< Which depth images, by their place in depth.txt.
};

/// Reads the folder's lists; images are decoded one by one.
/// @throws std::runtime_error for what is missing or malformed, with file and line.
std::unique_ptr<FrameSource> openTumFrames(const TumOptions& options);

}  // namespace dtsdf
