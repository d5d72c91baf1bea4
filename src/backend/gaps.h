/// Dropping the triangles of a block's mesh that stand in gaps.
#pragma once

#include "dtsdf_mapping/block_mesh.h"

namespace dtsdf {

/// Drops the triangles that are marked as standing in gaps (kernels/meshing/gap.h), and the
/// vertices that only they had. The order of all others stays.
void dropGaps(BlockMesh& mesh);

}  // namespace dtsdf
