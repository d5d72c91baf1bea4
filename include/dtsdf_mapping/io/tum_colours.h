/// Colour images of a TUM RGB-D folder behind the ColourSource seam.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/io/colour_source.h"

namespace dtsdf {

/// Opens the images that rgb.txt lists, .png or .jpg, by stamp; null if there is no such list.
/// Each has the pose at its own stamp, from groundtruth.txt, if one is at most `pose_tolerance_s`
/// away. Their camera is that of colour_info.yaml, or else that of the depth images, as in folders
/// whose images are registered; its size must be theirs.
/// @throws std::runtime_error for what is missing or malformed, with file and line.
std::unique_ptr<ColourSource> openTumColours(const std::string& folder, double pose_tolerance_s);

}  // namespace dtsdf
