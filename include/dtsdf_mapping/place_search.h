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
  /// or if the image fits along a whole stretch, as in a corridor; the pose is then only one of
  /// several that fit.
  Alignment alignment;
  /// Share of the image's depths that match those of the map as rendered from the pose.
  double explained_share = 0.0;
  /// If kAmbiguous: another pose, optical frame to W.
  std::optional<Eigen::Isometry3d> other_T_W_C;
};

/// Finds where a frame was taken; its own pose is ignored. The image is compared with coarse views
/// of the map from a grid of standpoints, in evenly spread orientations. The best poses are refined
/// on a coarse distance field, and the image is aligned to the map from the best of these. The
/// result is the same on every backend and with any number of threads. The search takes seconds on
/// a CPU. It reads the map piece by piece into a coarse copy, whose cells are three or more voxels
/// wide. The copy takes 9 bytes per cell, at most 130 MB, and 32 more bytes for each cell with a
/// surface.
/// @param mapper Holds the map, which is not changed. No other thread may use it during the search.
/// The search waits for the mapper's device.
/// @param frame The image, with its camera.
/// @param threads Host threads; 0: all cores.
/// @throws std::exception when the backend fails.
FoundPlace findPlace(Mapper& mapper, const DepthFrame& frame, int threads);

}  // namespace dtsdf
