/// Turns a TUM RGB-D folder into a bag: depth, camera_info, TF and colour.
#pragma once

#include <map>
#include <string>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

struct TumToBagOptions {
  std::string folder;
  std::string bag;
  double units_per_metre = 5000.0;
  /// 16UC1 in millimetres, as many drivers send it: half the size, but TUM's 0.2 mm are rounded.
  bool millimetres = false;
  std::string map_frame = "map";
  std::string camera_frame = "camera_depth_optical_frame";
  std::string camera_namespace = "/camera";
};

struct TumToBagResult {
  size_t depth_images = 0;
  size_t colour_images = 0;
  std::map<std::string, size_t> skipped;  ///< Depth images left out, by reason.
};

/// The bag is written beside its place and renamed when it is whole.
/// @throws std::runtime_error for a folder that cannot be read or a bag that cannot be written.
TumToBagResult convertTumToBag(const TumToBagOptions& options);

}  // namespace dtsdf
