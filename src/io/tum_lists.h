/// Reads the lists in a TUM RGB-D folder: depth images, colour images and poses. Does not decode
/// images.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/camera_file.h"
#include "io/trajectory.h"

namespace dtsdf {

/// An image of a recording, with its pose or the reason why it has none.
struct StampedImage {
  double stamp_s;
  std::string path;
  std::optional<Eigen::Isometry3d> T_W_C = std::nullopt;
  std::string missing = {};  ///< Such as "no pose within 20 ms".
};

// Lines that begin with # are comments. The functions that read files throw std::runtime_error if a
// file is missing, or, with the line number, if a line is malformed.

/// Whether a folder has depth.txt, or associations.txt together with groundtruth.txt or
/// camera_info.yaml. An ICL-NUIM folder also contains associations.txt, but neither groundtruth.txt
/// nor camera_info.yaml.
bool isTumFolder(const std::filesystem::path& folder);
/// The images in associations.txt whose paths begin with `kind`. An example of a line is "0
/// depth/0.png 0 rgb/0.png"; depth or colour may come first. @throws std::runtime_error if there
/// are none.
std::vector<StampedImage> readAssociations(const std::filesystem::path& folder,
                                           const std::string& kind);

/// The depth images in the order of depth.txt, or of associations.txt if there is no depth.txt.
std::vector<StampedImage> readTumDepthList(const std::filesystem::path& folder);
/// The colour images in the order of rgb.txt. Without rgb.txt, those in associations.txt, or none
/// if the folder has depth.txt.
std::vector<StampedImage> readTumColourList(const std::filesystem::path& folder);
/// Reads groundtruth.txt, whose poses map the optical frame to the map frame.
Trajectory readTumTrajectory(const std::filesystem::path& folder);

/// Reads camera_info.yaml. @return std::nullopt if there is no such file and the recording is one
/// of the benchmark's own, which all have "freiburg" in their names.
std::optional<CameraInfo> readTumCamera(const std::filesystem::path& folder);

}  // namespace dtsdf
