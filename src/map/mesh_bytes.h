/// What the mesh of a block takes in memory.
#pragma once

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

inline size_t bytesOf(const BlockMesh& block) {
  return sizeof(block) + block.vertices.size() * sizeof(BlockVertex) +
         block.triangles.size() * sizeof(uint16_t) + block.colours.size() * sizeof(VertexColour);
}

}  // namespace dtsdf
