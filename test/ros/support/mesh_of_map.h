/// Computes how many triangles the node and its subscribers should have for a saved map.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "params/node_params.h"
#include "tools/map_settings.h"

namespace dtsdf {

struct MeshOfMap {
  size_t triangles = 0;  ///< In the node's status.
  size_t shown = 0;      ///< In messages, where small holes are closed.
};

inline MeshOfMap meshOfMap(const std::string& path) {
  const MapContents contents = loadMap(path);
  const MapperParams params = settingsFor(contents, {"backend=cpu"}).params.mapper;
  MeshStore mesh(params.map.voxel_size_m);
  mesh.apply(makeMapper(params, contents)->updateMesh());
  const int chunk_blocks = NodeParams().chunk_blocks;
  const ChunkLattice lattice(mesh.voxelSize(), chunk_blocks);
  MeshChunks chunks(chunk_blocks);
  for (const auto& [key, block] : mesh.blocks()) chunks.markChanged(block->key);
  MeshOfMap found{mesh.triangleCount()};
  for (const PackedKey chunk : chunks.all()) {
    found.shown +=
        packChunk(mesh, lattice, chunks.cornerOf(chunk), chunks.blocksOf(chunk)).triangleCount();
  }
  return found;
}

}  // namespace dtsdf
