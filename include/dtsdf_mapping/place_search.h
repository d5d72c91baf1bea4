/// Finds a camera in a map without any pose: where in it a depth image was taken.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// Where an image was taken.
struct FoundPlace {
  /// kAligned, with the pose, where the camera was found. kAmbiguous where it looks alike somewhere
  /// else, or all along a way, as in a corridor: neither is chosen.
  Alignment alignment;
  /// Share of what the image measured that the map shows there as far away.
  double explained_share = 0.0;
  std::optional<Eigen::Isometry3d> other_T_W_C;  ///< Where it looks alike; optical frame to map.
};

/// Finds where a frame was taken; its own pose is not looked at. Coarse views of the map from
/// everywhere are compared with the image, in all orientations; the best are moved to where the
/// image fits the map's coarse distances, and the best of these aligned as any image is. The result
/// is the same on every backend and number of threads. Takes seconds on a CPU. Reads the map piece
/// by piece, and keeps 9 bytes a cell of what it is like meanwhile, 130 MB at most.
/// @param mapper The map; it is not changed, nor used by another thread meanwhile. Waits for its
/// device.
/// @param frame The image, with its camera.
/// @param threads Of the host; 0: all cores.
/// @throws std::exception when the backend fails.
FoundPlace findPlace(Mapper& mapper, const DepthFrame& frame, int threads);

}  // namespace dtsdf
