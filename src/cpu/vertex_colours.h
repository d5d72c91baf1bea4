/// Colours of a block's vertices on the CPU.
#pragma once

#include <vector>

#include "cpu/voxel_store.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/colour/vertex_colour.h"

namespace dtsdf {

/// The voxels and colours from which the colours of a block's vertices are computed. Voxels with
/// less than `min_evidence` count as unknown.
ColouredCorners colouredCorners(const CpuMap& map, const BlockKey& key, int32_t min_evidence);

/// Computes the colours of a block's vertices. The midpoint of a triangle's side gets the mean
/// colour of the side's ends.
std::vector<VertexColour> vertexColours(ColouredCorners corners,
                                        const std::vector<BlockVertex>& vertices, bool directional);

}  // namespace dtsdf
