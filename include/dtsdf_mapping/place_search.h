/// Finds where in a map a depth image was taken, without any prior pose.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// Where an image was taken.
struct FoundPlace {
  /// kAligned, with the pose, if the camera was found. kAmbiguous if another place looks the same,
  /// or a whole stretch does, as in a corridor: none is chosen.
  Alignment alignment;
  /// Share of the image's measurements at whose depth the map shows a surface, seen from the pose.
  double explained_share = 0.0;
  std::optional<Eigen::Isometry3d> other_T_W_C;  ///< Pose that looks the same, optical frame to W.
};

/// Finds where a frame was taken; its own pose is ignored. The image is compared with coarse views
/// of the map from everywhere, in all orientations. The best poses are moved to where the image
/// fits the map's coarse distances, and the best of these are aligned like any image. The result is
/// the same on every backend and number of threads. The search takes seconds on a CPU. It reads the
/// map piece by piece into a coarse copy of 9 bytes a cell, 130 MB at most.
/// @param mapper Has the map, which is not changed. No other thread may use it during the search.
/// The search waits for its device.
/// @param frame The image, with its camera.
/// @param threads Host threads; 0: all cores.
/// @throws std::exception when the backend fails.
FoundPlace findPlace(Mapper& mapper, const DepthFrame& frame, int threads);

}  // namespace dtsdf
