/// Recordings in the folder layout of tsdf-fusion and 7-Scenes: frame-NUMBER.depth.png in
/// millimetres and frame-NUMBER.pose.txt with a 4 x 4 matrix, camera to world.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "evaluation/camera_views.h"

namespace dtsdf {

/// One frame with a usable pose.
struct TsdfFusionFrame {
  std::string depth_path;
  Eigen::Isometry3d T_W_C;
};

struct TsdfFusionFolder {
  std::vector<TsdfFusionFrame> frames;  ///< By number.
  size_t without_pose = 0;              ///< Left out: the tracker had lost the camera there.
};

/// Lists the frames. A pose that is no rigid motion marks a frame whose camera was lost.
/// @throws std::runtime_error if there is no depth image, or a pose file is missing or malformed.
TsdfFusionFolder readTsdfFusionFolder(const std::string& folder);

/// Image size of a depth image, with the intrinsics that are known from elsewhere.
/// @throws std::runtime_error if it is no 16-bit grey image.
ViewCamera cameraForImage(const std::string& depth_path, const Intrinsics& intrinsics);

/// Depth in metres, row-major; 0 where nothing was measured, and for 65535, 7-Scenes' mark for
/// that. @throws std::runtime_error if it is no 16-bit image of the camera's size.
std::vector<float> readMillimetres(const std::string& depth_path, const ViewCamera& camera);

}  // namespace dtsdf
