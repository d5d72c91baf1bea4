/// Invariants that the mesh of any map must satisfy.
#pragma once

#include <cmath>

#include "dtsdf_mapping/mesh.h"
#include "fuzz/fuzz_input.h"
#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"

namespace dtsdf {

inline bool isFinite(const Vec3f& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

inline void checkMesh(const Mesh& mesh) {
  for (const Vec3f& vertex : mesh.vertices_m) require(isFinite(vertex), "finite vertices");
  for (const Vec3f& normal : mesh.normals) require(isFinite(normal), "finite normals");
  require(mesh.normals.size() == mesh.vertices_m.size(), "a normal for each vertex");
  require(mesh.colours.empty() || mesh.colours.size() == mesh.vertices_m.size(),
          "no colours, or one for each vertex");
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t index : triangle) require(index < mesh.vertices_m.size(), "valid indices");
  }
}

/// Invariants of the chunks of a mesh, as published.
inline void checkChunks(const MeshStore& store) {
  constexpr int kChunkBlocks = 2;
  const ChunkLattice lattice(store.voxelSize(), kChunkBlocks);
  MeshChunks chunks(kChunkBlocks);
  for (const auto& [key, block] : store.blocks()) chunks.markChanged(block->key);
  size_t triangles = 0, chunk_triangles = 0;
  for (const PackedKey chunk : chunks.all()) {
    const PackedChunk packed =
        packChunk(store, lattice, chunks.cornerOf(chunk), chunks.blocksOf(chunk));
    checkChunk(packed);
    triangles += packed.triangleCount();
    for (const PackedKey key : chunks.blocksOf(chunk)) {
      const auto block = store.blocks().find(key);
      if (block != store.blocks().end()) chunk_triangles += block->second->triangles.size() / 3;
    }
  }
  require(chunk_triangles == store.triangleCount(), "each triangle is in one chunk");
  require(triangles >= store.triangleCount(), "mending loses no triangle");
}

}  // namespace dtsdf
