/// What differs between two meshes of a map, by blocks.
#pragma once

#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// What a store lacks to be a mesh: of the blocks that it holds, or has in other bytes, `mesh` has
/// the newer ones; those that `mesh` has not are without triangles.
std::vector<SharedBlockMesh> differences(const MeshStore& store, std::vector<SharedBlockMesh> mesh);

}  // namespace dtsdf
