/// The lists of a TUM RGB-D folder: depth images, colour images and poses. Decodes no image.
#pragma once

#include <string>
#include <vector>

#include "io/camera_file.h"
#include "io/trajectory.h"

namespace dtsdf {

struct StampedImage {
  double stamp_s;
  std::string path;
};

// Lines that begin with # are comments.
// Each throws std::runtime_error for a missing file or a malformed line, with file and line.

/// In the order of depth.txt.
std::vector<StampedImage> readTumDepthList(const std::string& folder);
/// In the order of rgb.txt; empty where there is none.
std::vector<StampedImage> readTumColourList(const std::string& folder);
/// groundtruth.txt: optical frame to map frame.
Trajectory readTumTrajectory(const std::string& folder);

/// camera_info.yaml; where there is none, the camera of the benchmark's own recordings, all of
/// which have freiburg in their name.
CameraInfo readTumCamera(const std::string& folder);

}  // namespace dtsdf
