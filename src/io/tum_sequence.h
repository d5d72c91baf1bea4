/// The lists of a TUM RGB-D folder: depth images, colour images and poses. Decodes no image.
#pragma once

#include <string>
#include <vector>

#include "io/camera_info_file.h"
#include "io/trajectory.h"

namespace dtsdf {

struct StampedImage {
  double stamp_s;
  std::string path;
};

struct TumSequence {
  std::vector<StampedImage> depth;   ///< In the order of depth.txt.
  std::vector<StampedImage> colour;  ///< In the order of rgb.txt; empty where there is none.
  Trajectory trajectory{{}};         ///< groundtruth.txt: optical frame to map frame.
  CameraInfo camera;                 ///< Of the depth images.
};

// The parts of a folder. Lines that begin with # are comments.
// Each throws std::runtime_error for a missing file or a malformed line, with file and line.

std::vector<StampedImage> readTumDepthList(const std::string& folder);
std::vector<StampedImage> readTumColourList(const std::string& folder);  ///< May be empty.
Trajectory readTumTrajectory(const std::string& folder);

/// camera_info.yaml; where there is none, the camera of the benchmark's own recordings, all of
/// which have freiburg in their name.
CameraInfo readTumCamera(const std::string& folder);

/// All of them. @throws std::runtime_error as above.
TumSequence readTumSequence(const std::string& folder);

}  // namespace dtsdf
