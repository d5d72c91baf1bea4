/// Reads poses from files of other programs: lists of matrices, COLMAP's images.txt,
/// transforms.json, and folders with one matrix per file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// Finds the poses of images in a file; some images may have none. A list in TUM's format is
/// matched by stamp; COLMAP's images.txt, transforms.json and a folder with files of 4 x 4 numbers
/// by name, or else by the number at its end; a list of 3 x 4 (KITTI) or 4 x 4 numbers (Open3D's
/// trajectory.log) in the order of the images if it has as many poses, or else by number.
/// @param convention One of RecordingOptions::pose_convention; empty: that of the file's format.
/// @throws std::runtime_error with file and line if anything is missing or malformed.
void findPosesIn(const std::string& path, double tolerance_s, std::vector<StampedImage>& images,
                 std::string convention = "");

/// Converts poses from a convention to the optical frame. @throws as opticalPose()
void convertToOptical(const std::string& convention, std::vector<StampedImage>& images);

/// The pose of the optical frame, from a pose in this convention.
/// @throws std::invalid_argument for an unknown convention.
Eigen::Isometry3d opticalPose(const Eigen::Isometry3d& pose, const std::string& convention);

/// The number at the end of a file's name, before the extension.
std::optional<double> numberAtEnd(const std::string& path);

/// Reads a JSON object. @throws std::runtime_error with `advice` if the file holds none.
nlohmann::json readJsonFile(const std::string& path, const std::string& advice);

}  // namespace dtsdf
