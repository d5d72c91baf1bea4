/// Drops triangles that span gaps; shared by both backends.
#pragma once

#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/gap.h"

namespace dtsdf {

/// Drops the triangles that are marked as spanning gaps (kernels/meshing/gap.h). The order of the
/// remaining triangles is unchanged; vertices used only by dropped triangles stay.
inline void dropGaps(BlockMesh& mesh) {
  uint16_t* kept = mesh.triangles.data();
  const uint16_t* const end = kept + mesh.triangles.size();
  for (const uint16_t* from = kept; from != end; from += 3) {
    if (isMarkedGap(from)) continue;
    for (int corner = 0; corner < 3; ++corner) kept[corner] = from[corner];
    kept += 3;
  }
  mesh.triangles.resize(static_cast<size_t>(kept - mesh.triangles.data()));
}

}  // namespace dtsdf
