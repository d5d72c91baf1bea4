/// Joins block meshes without smoothing or repairing their outlines.
#pragma once

#include <vector>

#include "meshing/mesh_stream.h"

namespace dtsdf {

/// Joins the blocks with these packed keys, which must be in ascending order. Keys missing from the
/// store are skipped.
inline Mesh rawMesh(const MeshStore& store, const std::vector<PackedKey>& keys) {
  Mesh mesh;
  BlockJoiner joiner;
  for (const PackedKey key : keys) {
    const auto found = store.blocks().find(key);
    if (found == store.blocks().end()) continue;
    const BlockMesh& block = *found->second;
    const JoinedBlock& joined = joiner.add(block);
    for (const uint32_t i : joined.fresh) {
      mesh.vertices_m.push_back(
          positionFrom(mesh.origin_m, store.positionInMap(block.key, block.vertices[i])));
      mesh.normals.push_back({0.0f, 0.0f, 0.0f});
    }
    for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
      const uint16_t* const corner = &block.triangles[t];
      mesh.triangles.push_back(
          {joined.number[corner[0]], joined.number[corner[1]], joined.number[corner[2]]});
      addNormal(block, joined, corner, mesh.triangles.back(), mesh.normals);
    }
  }
  makeUnit(mesh.normals);
  return mesh;
}

inline Mesh rawMesh(const MeshStore& store) {
  std::vector<PackedKey> keys;
  for (const auto& [key, block] : store.blocks()) keys.push_back(key);
  return rawMesh(store, keys);
}

}  // namespace dtsdf
