/// Reads poses from files written by other programs: lists of matrices, COLMAP's images.txt,
/// transforms.json, and folders with one matrix per file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// Finds the poses of images in a file or folder; some images may have none. Images are matched
/// - by stamp: a list in TUM's format;
/// - by name or, if no name matches, by the number at its end: COLMAP's images.txt,
///   transforms.json, and a folder with one file per image that contains a 4 x 4 matrix;
/// - by order if there are as many poses as images, otherwise by number: a list of 3 x 4 (KITTI) or
///   4 x 4 matrices, such as Open3D's trajectory.log. If the list has as many poses as there are
///   depth images, a colour image gets the pose of the depth image with the same stamp or number.
/// @param depth The depth images, sorted by stamp; may be `images`.
/// @param convention See RecordingOptions::pose_convention. If empty, the file format's usual
/// convention is used.
/// @throws std::runtime_error that names the file, if anything is missing or malformed.
void findPosesIn(const std::string& path, double tolerance_s,
                 const std::vector<StampedImage>& depth, std::vector<StampedImage>& images,
                 std::string convention);

/// Applies opticalPose() to all poses. @throws like opticalPose()
void convertToOptical(const std::string& convention, std::vector<StampedImage>& images);

/// Converts a pose in the given convention to the pose of the camera's optical frame.
/// @throws std::invalid_argument for an unknown convention.
Eigen::Isometry3d opticalPose(const Eigen::Isometry3d& pose, const std::string& convention);

/// The number in a file's name without the extension: the whole name if it is a number, such as a
/// stamp, otherwise the digits at its end.
std::optional<double> numberAtEnd(const std::string& path);

/// Reads a JSON object. @throws std::runtime_error with `advice` if the file does not contain one.
nlohmann::json readJsonFile(const std::string& path, const std::string& advice);

}  // namespace dtsdf
