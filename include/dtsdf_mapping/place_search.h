/// Finds where in a map a depth image was taken, without any prior pose.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// Where an image was taken.
struct FoundPlace {
  /// kAligned, with the pose, if the camera was located. kAmbiguous if another place looks the
  /// same, or if the image fits anywhere along a line, as in a corridor; the pose is then only one
  /// of several that fit.
  Alignment alignment;
  /// Fraction of the measured depths that match the depth of the map rendered from the pose.
  double explained_share = 0.0;
  /// If kAmbiguous: another pose that fits, optical frame to map frame W.
  std::optional<Eigen::Isometry3d> other_T_W_C;
};

/// Finds the pose at which a frame was taken, ignoring the pose in the frame. The image is compared
/// with coarse views of the map from a grid of positions, in evenly spread orientations. The best
/// poses are refined on a coarse distance field, and the image is aligned to the map from the best
/// of these. The result is the same on every backend and with any number of threads. The search
/// takes seconds on a CPU. It reads the map piece by piece into a coarse copy, whose cells are
/// three or more voxels wide. The copy takes 9 bytes per cell, at most 130 MB, plus 32 bytes for
/// each cell with a surface.
/// @param mapper Holds the map, which is not changed. No other thread may use the mapper during the
/// search. The call waits for the mapper's device.
/// @param frame The depth image and its camera.
/// @param threads Host threads; 0: all cores.
/// @throws std::exception when the backend fails.
FoundPlace findPlace(Mapper& mapper, const DepthFrame& frame, int threads);

}  // namespace dtsdf
