/// Settings for the free-space grid and the distances, which planners use.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Whether and how the free-space grid is maintained.
struct SpaceParams {
  bool enabled = false;         ///< Whether to record free space; if false, it costs nothing.
  int cell_voxels = 4;          ///< Edge of a cell, in voxels: 1, 2, 4 or 8.
  float max_range_m = 5.0f;     ///< Maximum depth at which an image marks cells as free.
  float max_distance_m = 2.0f;  ///< Distances to surfaces are computed up to this value.
};

/// Visits each member with its key and the rule for its value.
/// @relates SpaceParams
template <class Visitor>
void visitParams(SpaceParams& p, Visitor& visit) {
  visit("space/enabled", p.enabled);
  visit("space/cell_voxels", p.cell_voxels, Range{1, 8});
  visit("space/max_range_m", p.max_range_m, Range{0.1, 1000.0});
  visit("space/max_distance_m", p.max_distance_m, Range{0.01, 1000.0});
}

}  // namespace dtsdf
