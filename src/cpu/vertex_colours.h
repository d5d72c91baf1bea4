/// Colours of a block's vertices on the CPU.
#pragma once

#include <vector>

#include "cpu/voxel_store.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/colour/vertex_colour.h"

namespace dtsdf {

/// The voxels and colours from which a block's vertices get their colours. Voxels with less than
/// `min_evidence` count as unknown.
ColouredCorners colouredCorners(const CpuMap& map, const BlockKey& key, int32_t min_evidence);

/// The colours of a block's vertices; the midpoint of a side gets the mean of its ends.
std::vector<VertexColour> vertexColours(ColouredCorners corners,
                                        const std::vector<BlockVertex>& vertices, bool directional);

}  // namespace dtsdf
