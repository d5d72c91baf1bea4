#include "ros/common/chunk_message.h"

#include <algorithm>
#include <utility>

namespace dtsdf {

using dtsdf_mapping::MeshBlock;

MeshBlock toMessage(PackedChunk chunk) {
  MeshBlock block;
  std::copy(chunk.origin.begin(), chunk.origin.end(), block.origin.begin());
  block.positions = std::move(chunk.positions);
  block.normals = std::move(chunk.normals);
  block.colours = std::move(chunk.colours);
  block.triangles = std::move(chunk.triangles16);
  block.triangles32 = std::move(chunk.triangles32);
  return block;
}

PackedChunk toChunk(MeshBlock block) {
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
