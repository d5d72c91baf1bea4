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

/// What the vertices of a block take their colours from. `least_evidence` is what a voxel needs to
/// be known.
ColouredCorners colouredCorners(const MeshedMap& map, const BlockKey& key, int32_t least_evidence);

/// The vertexColourOf() of each of a block's vertices.
std::vector<VertexColour> vertexColours(const ColouredCorners& corners,
                                        const std::vector<BlockVertex>& vertices, bool directional);

}  // namespace dtsdf
