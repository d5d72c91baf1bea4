/// Colours of a block's vertices on the CPU, once they are made.
#pragma once

#include <vector>

#include "cpu/voxel_store.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/colour/vertex_colour.h"
#include "map/block_table.h"

namespace dtsdf {

/// What a mesh is made of.
struct MeshedMap {
  const BlockTable& table;
  const VoxelStore& voxels;
  const ColourStore& colours;
};

/// One for each of a block's vertices. `least_evidence` is what a voxel needs to be known.
std::vector<VertexColour> vertexColours(const MeshedMap& map, const BlockMesh& mesh,
                                        int32_t least_evidence, bool directional);

}  // namespace dtsdf
