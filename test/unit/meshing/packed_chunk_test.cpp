// Tests the checks that chunks received from other programs must pass.
#include "meshing/packed_chunk.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace dtsdf {
namespace {

/// A chunk with this many coincident vertices and one triangle, which uses the last vertex.
PackedChunk chunkOf(size_t vertices) {
  PackedChunk chunk;
  chunk.positions.resize(3 * vertices);
  chunk.normals.resize(2 * vertices);
  const auto last = static_cast<uint16_t>(vertices - 1);
  chunk.triangles16 = {0, 1, last};
  return chunk;
}

TEST(PackedChunkCheck, RefusesMoreVerticesThanIndicesCanAddress) {
  EXPECT_NO_THROW(checkChunk(chunkOf(65536)));
  EXPECT_THROW(checkChunk(chunkOf(65537)), std::runtime_error);
}

TEST(PackedChunkCheck, RefusesImpossibleSteps) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_NO_THROW(checkStep(ChunkLattice(0.001f, 64).step_m));
  EXPECT_NO_THROW(checkStep(ChunkLattice(1.0f, 1).step_m));
  for (const double step_m :
       {0.0, -0.01, 1.01, kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(checkStep(step_m), std::runtime_error) << step_m;
  }
}

}  // namespace
}  // namespace dtsdf
