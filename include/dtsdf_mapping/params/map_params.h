/// Settings for the map.
#pragma once

#include <string>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Resolution, kind and size of a map.
struct MapParams {
  float voxel_size_m = 0.02f;      ///< Edge of a voxel, in metres.
  float truncation_voxels = 4.0f;  ///< Truncation distance, in voxels.
  /// Whether to use six directional volumes instead of one ordinary TSDF.
  bool directional = true;
  /// Memory budget of the map in MiB. Once it is used up, new blocks are refused. With
  /// space/enabled, free cells get an eighth of the budget.
  int max_memory_mb = 4096;
  float keep_radius_m = 0.0f;  ///< Blocks that are entirely farther than this from the camera (or
                               ///< from DepthFrame::keep_center_W, if set) are dropped; 0: off.
  /// Folder to which the least recently used blocks are written when the budget is used up; they
  /// are read back when needed. Empty: no paging; the map is limited to the budget.
  std::string page_folder;
  float page_max_gb = 64.0f;  ///< Maximum size of each file in page_folder, in GiB.
};

/// Visits each member with its key and the rule for its value.
/// @relates MapParams
template <class Visitor>
void visitParams(MapParams& p, Visitor& visit) {
  visit("map/voxel_size_m", p.voxel_size_m, Range{0.001, 1.0});
  visit("map/truncation_voxels", p.truncation_voxels, Range{1.0, 16.0});
  visit("map/directional", p.directional);
  visit("map/max_memory_mb", p.max_memory_mb, Range{1, 1 << 22});
  visit("map/keep_radius_m", p.keep_radius_m, Range{0.0, 1e6});
  visit("map/page_folder", p.page_folder);
  visit("map/page_max_gb", p.page_max_gb, Range{0.001, 1000.0});
}

}  // namespace dtsdf
