/// FrameSource and ColourSource for depth and colour images in files, each with its pose.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/recording.h"
#include "io/camera_file.h"
#include "io/trajectory.h"
#include "io/tum_lists.h"

namespace dtsdf {

/// The depth or the colour images of a recording.
struct RecordedImages {
  std::vector<StampedImage> images;  ///< Empty if the recording has none.
  /// Camera of all images. A negative fy means that its y axis points up: images and principal
  /// point are then flipped vertically, which does not change 3D points.
  std::optional<CameraInfo> camera = std::nullopt;
  std::string missing_camera = {};  ///< If there is no camera, the reason for skipping all images.
  double units_per_metre = 0.0;     ///< Depth units per metre.
};

/// Depth images in order, decoded one by one. @throws std::runtime_error if no image has a pose,
/// or like checkSelection().
std::unique_ptr<FrameSource> openRecordedImages(RecordedImages images,
                                                const RecordingOptions& options);

/// Colour images sorted by stamp, decoded one by one. Images without a pose or file, or with a size
/// other than the camera's, are skipped and counted. A damaged file is an error unless skip_bad is
/// set.
std::unique_ptr<ColourSource> openRecordedColours(RecordedImages images,
                                                  const RecordingOptions& options);

/// Finds the poses of images by stamp. If no image gets a pose, the first image's `missing`
/// describes how the stamps differ.
void findPosesNear(const Trajectory& trajectory, double tolerance_s,
                   std::vector<StampedImage>& images);

/// Checks that a range selects at least one image; a list of images may be empty.
/// @throws std::runtime_error that states the number of images.
inline void checkSelection(const FrameSelection& selection, size_t total) {
  if (selection.listed != nullptr || total == 0 || selection.countIn(total) > 0) return;
  throw std::runtime_error("--frames selects none of the depth images: there are " +
                           std::to_string(total) + ", numbered 0 to " + std::to_string(total - 1) +
                           "; give a range of these");
}

/// Whether the options select an image. @param place Its index among the depth or colour images.
inline bool isSelected(const RecordingOptions& options, bool is_colour, size_t place) {
  if (!is_colour) return options.selection.contains(place);
  const auto& listed = options.listed_colours;
  return options.selection.containsColour(place) &&
         (listed == nullptr || std::binary_search(listed->begin(), listed->end(), place));
}

}  // namespace dtsdf
