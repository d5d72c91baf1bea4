/// The lists of a TUM RGB-D folder: depth images, colour images and poses. Decodes no image.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/camera_file.h"
#include "io/trajectory.h"

namespace dtsdf {

/// An image of a recording, and its pose once it is known, or why there is none.
struct StampedImage {
  double stamp_s;
  std::string path;
  std::optional<Eigen::Isometry3d> T_W_C = std::nullopt;
  std::string missing = {};  ///< "no pose within 20 ms"; counted as a reason.
};

// Lines that begin with # are comments.
// Each throws std::runtime_error for a missing file or a malformed line, with file and line.

/// Whether a folder has depth.txt; or associations.txt and poses or a camera, as ORB-SLAM's users
/// have it, not ICL-NUIM.
bool isTumFolder(const std::filesystem::path& folder);
/// The images whose files begin with `kind`, at least one: associations.txt has lines such as
/// "0 depth/0.png 0 rgb/0.png", in either order.
std::vector<StampedImage> readAssociations(const std::filesystem::path& folder,
                                           const std::string& kind);

/// In the order of depth.txt, or else of associations.txt.
std::vector<StampedImage> readTumDepthList(const std::filesystem::path& folder);
/// In the order of rgb.txt, or else of associations.txt; empty where there is none.
std::vector<StampedImage> readTumColourList(const std::filesystem::path& folder);
/// groundtruth.txt: optical frame to map frame.
Trajectory readTumTrajectory(const std::filesystem::path& folder);

/// camera_info.yaml; where there is none, the camera of the benchmark's own recordings, all of
/// which have freiburg in their name.
CameraInfo readTumCamera(const std::filesystem::path& folder);

}  // namespace dtsdf
