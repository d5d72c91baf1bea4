/// Settings for free space and distances, which planners use.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Whether and how free space is recorded.
struct SpaceParams {
  bool enabled = false;         ///< Whether free space is recorded; if not, it costs nothing.
  int cell_voxels = 4;          ///< Edge of a cell, in voxels: 1, 2, 4 or 8.
  float max_range_m = 5.0f;     ///< Depth up to which an image marks cells as free.
  float max_distance_m = 2.0f;  ///< Maximum distance to surfaces.
};

/// Visits each member with its key and its rule.
/// @relates SpaceParams
template <class Visitor>
void visitParams(SpaceParams& p, Visitor& visit) {
  visit("space/enabled", p.enabled);
  visit("space/cell_voxels", p.cell_voxels, Range{1, 8});
  visit("space/max_range_m", p.max_range_m, Range{0.1, 1000.0});
  visit("space/max_distance_m", p.max_distance_m, Range{0.01, 1000.0});
}

}  // namespace dtsdf
