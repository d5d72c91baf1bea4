/// A copy of a map, as arrays of voxels.
#pragma once

#include <cstdint>
#include <vector>

#include "dtsdf_mapping/map_contents.h"

namespace dtsdf::python {

/// Contents, and which block and direction each array of voxels is of.
struct Blocks {
  Blocks(MapContents map, float voxel_m);

  MapContents contents;
  float voxel_size_m;
  std::vector<uint32_t> block_of;
  std::vector<uint8_t> direction;
};

}  // namespace dtsdf::python
