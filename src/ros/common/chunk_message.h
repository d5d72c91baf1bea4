/// Converts mesh chunks to messages and back.
#pragma once

#include <dtsdf_mapping/MeshBlock.h>

#include <algorithm>
#include <utility>

#include "meshing/packed_chunk.h"

namespace dtsdf {

inline dtsdf_mapping::MeshBlock toMessage(PackedChunk chunk) {
  dtsdf_mapping::MeshBlock block;
  std::copy(chunk.origin.begin(), chunk.origin.end(), block.origin.begin());
  block.positions = std::move(chunk.positions);
  block.normals = std::move(chunk.normals);
  block.colours = std::move(chunk.colours);
  block.triangles = std::move(chunk.triangles16);
  block.triangles32 = std::move(chunk.triangles32);
  return block;
}

/// Checks the lengths of all fields, and the indices.
/// @throws std::runtime_error that says what is wrong with the message.
inline PackedChunk toChunk(dtsdf_mapping::MeshBlock block) {
  PackedChunk chunk;
  std::copy(block.origin.begin(), block.origin.end(), chunk.origin.begin());
  chunk.positions = std::move(block.positions);
  chunk.normals = std::move(block.normals);
  chunk.colours = std::move(block.colours);
  chunk.triangles16 = std::move(block.triangles);
  chunk.triangles32 = std::move(block.triangles32);
  checkChunk(chunk);
  return chunk;
}

}  // namespace dtsdf
