/// Reads cameras and poses from text files: camera_info.yaml as camera_calibration writes it, and
/// matrices.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/rendered_view.h"

namespace dtsdf {

/// A camera with rectified images. A default-constructed camera is valid, so functions that find no
/// camera return std::nullopt.
using CameraInfo = RenderCamera;

/// Reads the image size and the intrinsics: from projection_matrix, which describes the rectified
/// image, or from camera_matrix if there is no projection_matrix. Ignores distortion: images are
/// assumed to be rectified.
/// @throws std::runtime_error that names the file and says what is missing or wrong.
CameraInfo loadCameraInfo(const std::string& path);

/// Returns the camera of a folder's colour images: the one in colour_info.yaml if that file exists,
/// otherwise the depth camera.
CameraInfo colourCameraOf(const std::filesystem::path& folder, const CameraInfo& depth_camera);

/// The content of a camera_info.yaml file.
std::string cameraInfoText(const CameraInfo& camera, const std::string& camera_name);

/// Parses rows x columns numbers, in row-major order. Infinity becomes NaN, since trackers write
/// one or the other for frames in which tracking was lost.
/// @throws std::runtime_error that begins with `place`, if a word is not a number or the number of
/// words is wrong.
Eigen::MatrixXd parseMatrix(const std::vector<std::string>& words, int rows, int columns,
                            const std::string& place);

/// Reads a file that contains only a matrix; see parseMatrix().
/// @throws std::runtime_error like parseMatrix(), or with `advice` if the file cannot be read.
Eigen::MatrixXd readMatrixFile(const std::string& path, int rows, int columns,
                               const std::string& advice);

/// Converts a 4 x 4 matrix to a pose and orthonormalises its rotation. @return std::nullopt if the
/// matrix is not a rigid motion, as when tracking was lost.
std::optional<Eigen::Isometry3d> rigidMotion(const Eigen::Matrix4d& matrix);

/// The camera with these intrinsics; the matrix's first two rows begin with fx 0 cx and 0 fy cy.
/// @throws std::runtime_error that begins with `place`, if a number is not finite or a focal length
/// is not positive.
CameraInfo cameraOfMatrix(const Eigen::MatrixXd& matrix, int width, int height,
                          const std::string& place);

}  // namespace dtsdf
