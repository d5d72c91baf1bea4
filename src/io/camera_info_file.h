/// Camera intrinsics from a camera_info.yaml as camera_calibration writes it.
#pragma once

#include <string>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

struct CameraInfo {
  int width = 0, height = 0;          ///< In pixels.
  Intrinsics intrinsics{0, 0, 0, 0};  ///< Of the rectified image.
};

/// Reads size and intrinsics: projection_matrix, which describes the rectified image, or
/// camera_matrix where there is none. Distortion is not applied: depth images are rectified.
/// @throws std::runtime_error with the file and the key that is missing or wrong.
CameraInfo loadCameraInfo(const std::string& path);

}  // namespace dtsdf
