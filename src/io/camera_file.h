/// Cameras and poses in text files: camera_info.yaml as camera_calibration writes it, and matrices,
/// as many recordings have them.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

struct CameraInfo {
  int width = 0, height = 0;          ///< In pixels.
  Intrinsics intrinsics{0, 0, 0, 0};  ///< Those of the rectified image.
  bool is_assumed = false;            ///< They come from the format, not from a file of the folder.
};

/// Reads size and intrinsics: projection_matrix, which describes the rectified image, or
/// camera_matrix where there is none. Distortion is not applied: depth images are rectified.
/// @throws std::runtime_error with the file and the key that is missing or wrong.
CameraInfo loadCameraInfo(const std::string& path);

/// The camera of a folder's colour images: that of colour_info.yaml, or else of its depth images.
CameraInfo colourCameraOf(const std::filesystem::path& folder, const CameraInfo& depth_camera);

/// The text of such a file.
std::string cameraInfoText(const CameraInfo& camera, const std::string& camera_name);

/// rows x columns numbers, row by row. Words for infinity and for what is no number, with which
/// trackers say that they lost the camera, become NaN.
/// @throws std::runtime_error that begins with `place`, for other words and another count of them.
Eigen::MatrixXd parseMatrix(const std::vector<std::string>& words, int rows, int columns,
                            const std::string& place);

/// Parses all words of a file in the same way.
/// @throws std::runtime_error also if it cannot be read.
Eigen::MatrixXd readMatrixFile(const std::string& path, int rows, int columns,
                               const std::string& advice);

/// The pose of a 4 x 4 matrix; nothing if it is no rigid motion, as of a camera that was lost.
std::optional<Eigen::Isometry3d> rigidMotion(const Eigen::Matrix4d& matrix);

/// The camera of a matrix that begins with fx 0 cx, 0 fy cy.
/// @throws std::runtime_error that begins with `place`, if it is none.
CameraInfo cameraOfMatrix(const Eigen::MatrixXd& matrix, int width, int height,
                          const std::string& place);

}  // namespace dtsdf
