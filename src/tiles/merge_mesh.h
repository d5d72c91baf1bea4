/// Joins the meshes of tiles.
#pragma once

#include <string>
#include <vector>

#include "io/ply_stream.h"
#include "kernels/core/grid.h"
#include "meshing/mesh_origin.h"

namespace dtsdf {

/// A tile's meshes, and a bound of where they begin.
struct MeshOfTile {
  size_t tile;
  std::string path;
  uint64_t checksum;   ///< As its record has it.
  PackedKey first;     ///< None of its blocks comes before this one.
  BlockBounds bounds;  ///< Of the blocks that have a mesh.
};

/// What the whole map is.
struct MeshedWhole {
  float voxel_size_m;
  bool painted;
};

/// Writes the mesh that a mapper of the whole map would have, vertices and triangles in its order.
/// @throws std::runtime_error that names a damaged tile of the folder
void mergeMeshes(const std::vector<MeshOfTile>& meshes, const std::string& folder,
                 const MeshedWhole& whole, PlyStream& ply);

}  // namespace dtsdf
