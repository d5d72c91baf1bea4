/// Colour images in files, each with its pose, behind the ColourSource seam.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/colour_source.h"
#include "io/camera_info_file.h"
#include "io/recorded_images.h"

namespace dtsdf {

struct RecordedColours {
  std::vector<StampedImage> images;  ///< In any order. None: the recording has no colour.
  std::vector<ImagePose> poses;      ///< One for each, once they are known.
  std::optional<CameraInfo> camera;  ///< A negative fy turns the images, as RecordedImages says.
  std::string missing_camera;        ///< Why there is none; counted as a reason.
  /// The others are not looked at, and not counted; null: all are.
  std::shared_ptr<const std::vector<size_t>> listed;
};

/// By stamp, decoded one by one. What has no pose, no file or another size than the camera is
/// passed over and counted, as the map does without it; a damaged file is an error.
std::unique_ptr<ColourSource> openRecordedColours(RecordedColours recorded);

}  // namespace dtsdf
