/// Depth and colour images in files, each with its pose, behind the seams FrameSource and
/// ColourSource: what all folders of recordings come down to.
#pragma once

#include <Eigen/Geometry>
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

/// Images of one kind.
struct RecordedImages {
  std::vector<StampedImage> images;  ///< None: the recording has none.
  /// Camera of all images. A negative fy says that its y axis points up: the images are turned
  /// upside down, and the principal point with them, which leaves every point where it is.
  std::optional<CameraInfo> camera = std::nullopt;
  std::string missing_camera = {};  ///< Why there is no camera; counted as a reason.
  double units_per_metre = 0.0;     ///< Scale of depth.
};

/// Depth images in their order, decoded one by one.
/// @throws std::runtime_error if nothing of it has a pose.
std::unique_ptr<FrameSource> openRecordedImages(RecordedImages images,
                                                const RecordingOptions& options);

/// Colour images by stamp, decoded one by one. What has no pose, no file or another size than the
/// camera is passed over and counted, as the map does without it; a damaged file is an error,
/// unless skip_bad.
std::unique_ptr<ColourSource> openRecordedColours(RecordedImages images,
                                                  const RecordingOptions& options);

/// Finds the poses of images by their stamps; where there are none, the first says how stamps
/// differ.
void findPosesNear(const Trajectory& trajectory, double tolerance_s,
                   std::vector<StampedImage>& images);

/// Whether any of a recording's images is selected; images of a list of its own may be none.
/// @throws std::runtime_error that says how many there are.
inline void checkSelection(const FrameSelection& selection, size_t total) {
  if (selection.listed != nullptr || total == 0 || selection.countIn(total) > 0) return;
  throw std::runtime_error("none of the depth images is selected: there are " +
                           std::to_string(total) + ", 0 to " + std::to_string(total - 1) +
                           "; give a range of these by --frames");
}

}  // namespace dtsdf
