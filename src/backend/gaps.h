/// Drops the triangles of a block's mesh that span gaps.
#pragma once

#include "dtsdf_mapping/block_mesh.h"

namespace dtsdf {

/// Drops the triangles that are marked as spanning gaps (kernels/meshing/gap.h). The order of the
/// others is unchanged; vertices that only they used stay.
void dropGaps(BlockMesh& mesh);

}  // namespace dtsdf
