/// Poses as other programs write them: lists of matrices, COLMAP's images.txt, transforms.json, and
/// folders with a matrix in each file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// Finds the poses of images, as far as the file has them. By stamp from a list in TUM's format; by
/// name, or else by the number at its end, from COLMAP's images.txt, transforms.json, and a folder
/// with files of 4 x 4 numbers; from a list of 3 x 4 (KITTI) or 4 x 4 numbers (Open3D's
/// trajectory.log) in the order of the images where there are as many, or else by number.
/// @param convention One of RecordingOptions::pose_convention; empty: as the file's format has it.
/// @throws std::runtime_error with file and line for what is missing or malformed.
void findPosesIn(const std::string& path, double tolerance_s, std::vector<StampedImage>& images,
                 std::string convention = "");

/// Makes poses of a convention those of the optical frame. @throws as opticalPose()
void turnToOptical(const std::string& convention, std::vector<StampedImage>& images);

/// The optical frame's pose, of one as a convention has it.
/// @throws std::invalid_argument for an unknown convention.
Eigen::Isometry3d opticalPose(const Eigen::Isometry3d& pose, const std::string& convention);

/// The number at the end of a file's name, without its extension.
std::optional<double> numberAtEnd(const std::string& path);

/// A file of JSON. @throws std::runtime_error with `advice` if it is none.
nlohmann::json readJsonFile(const std::string& path, const std::string& advice);

}  // namespace dtsdf
