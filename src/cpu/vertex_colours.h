/// Colours of a block's vertices on the CPU, once they are made.
#pragma once

#include <vector>

#include "cpu/voxel_store.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/colour/vertex_colour.h"

namespace dtsdf {

/// What the vertices of a block take their colours from. `least_evidence` is what a voxel needs to
/// be known.
ColouredCorners colouredCorners(const CpuMap& map, const BlockKey& key, int32_t least_evidence);

/// The colours of a block's vertices; the middle of a side has that between its ends.
std::vector<VertexColour> vertexColours(ColouredCorners corners,
                                        const std::vector<BlockVertex>& vertices, bool directional);

}  // namespace dtsdf
