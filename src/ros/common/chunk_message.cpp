#include "ros/common/chunk_message.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace dtsdf {

using dtsdf_mapping::MeshBlock;

namespace {

/// Far more than any map has: 2^31 blocks of 8 voxels with 512 steps each. Sums stay exact in a
/// double.
constexpr int64_t kFarthestOrigin = int64_t{1} << 43;

template <class Index>
void checkTriangles(const std::vector<Index>& triangles, size_t vertices) {
  if (triangles.size() % 3 != 0) throw std::runtime_error("triangles are not three vertices each");
  const auto last = std::max_element(triangles.begin(), triangles.end());
  if (last != triangles.end() && *last >= vertices) {
    throw std::runtime_error("a triangle has vertex " + std::to_string(*last) + " of " +
                             std::to_string(vertices));
  }
}

void check(const PackedChunk& chunk) {
  const size_t vertices = chunk.vertexCount();
  if (chunk.positions.size() != 3 * vertices || chunk.normals.size() != 2 * vertices ||
      (!chunk.colours.empty() && chunk.colours.size() != 3 * vertices)) {
    throw std::runtime_error("positions, normals and colours are of different numbers of vertices");
  }
  if (!chunk.triangles16.empty() && !chunk.triangles32.empty()) {
    throw std::runtime_error("there are triangles with indices of both widths");
  }
  checkTriangles(chunk.triangles16, vertices);
  checkTriangles(chunk.triangles32, vertices);
  for (const int64_t steps : chunk.origin) {
    if (steps < -kFarthestOrigin || steps > kFarthestOrigin) {
      throw std::runtime_error("the origin is out of range");
    }
  }
}

}  // namespace

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
  check(chunk);
  return chunk;
}

}  // namespace dtsdf
