/// A chunk of the mesh in few bytes, as it is sent: positions are whole steps of a lattice that all
/// chunks of a map share, so that chunks side by side meet without cracks. And one with less
/// detail, to be looked at from far away.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "meshing/mesh_chunks.h"

namespace dtsdf {

/// Where the vertices of a map's chunks may lie: on multiples of a step along each axis of W, which
/// divides a voxel into a power of two.
struct ChunkLattice {
  /// A chunk is a cube of `chunk_blocks` blocks along an edge. 512 steps a voxel, or less, so that
  /// 16 bits span a chunk and the two voxels beyond it that its vertices may reach.
  ChunkLattice(float voxel_size_m, int chunk_blocks);

  int chunk_blocks;
  int steps_per_voxel;
  double step_m;
};

/// Vertices and triangles of one chunk.
struct PackedChunk {
  std::array<int64_t, 3> origin = {};  ///< Where positions count from, in steps from W's origin.
  std::vector<uint16_t> positions;     ///< x, y, z of each vertex, in steps from the origin.
  std::vector<int16_t> normals;        ///< Two numbers per vertex, see packedNormal().
  std::vector<uint8_t> colours;        ///< Red, green, blue of each vertex; none if unpainted.
  std::vector<uint16_t> triangles16;   ///< Three vertices each, counter-clockwise from the free
                                       ///< side; or else
  std::vector<uint32_t> triangles32;   ///< here, if there are more than 65536 vertices.

  size_t vertexCount() const { return positions.size() / 3; }
  size_t triangleCount() const { return (triangles16.size() + triangles32.size()) / 3; }
  /// The vertex that a corner of a triangle is: corner i of triangle t is number 3 t + i.
  uint32_t corner(size_t number) const {
    return triangles32.empty() ? triangles16[number] : triangles32[number];
  }
};

/// The chunk whose lowest block is `corner`, of the blocks with these packed keys, in their order
/// (unknown ones are skipped). Without triangles it has its origin only.
PackedChunk packChunk(const MeshStore& mesh, const ChunkLattice& lattice, const BlockKey& corner,
                      const std::vector<PackedKey>& blocks);

/// Whether the lengths of its parts, its indices and its origin hold together, as all else here
/// relies on. For chunks that others have made. @throws std::runtime_error that says what is wrong.
void checkChunk(const PackedChunk& chunk);

/// Checks a lattice's step. @throws std::runtime_error that says what is wrong.
void checkStep(double step_m);

/// Position of a vertex in W, in metres. Chunks that share a vertex give the same bits.
std::array<double, 3> positionOf(const PackedChunk& chunk, double step_m, size_t vertex);

/// The octahedral map of a unit vector: its shadow on the octahedron |x| + |y| + |z| = 1, the lower
/// half folded outwards, in units of 1 / 32767.
std::array<int16_t, 2> packedNormal(const Vec3f& normal);
Vec3f normalOfPacked(int16_t u, int16_t v);

/// The chunk in W, its positions as floats: what is left of them far from the origin is for colours
/// by height.
Mesh unpackChunk(const PackedChunk& chunk, double step_m);

/// The chunk with one vertex for all that lie in one cell and face the same of six ways: both sides
/// of a thin thing stay apart. Cells are cubes of 2^cell_log2 steps, the same for all chunks, and a
/// vertex goes to the middle of its cell, a quarter towards where it faces: chunks side by side
/// still meet. Triangles that are left without area are left out.
PackedChunk coarsen(const PackedChunk& chunk, int cell_log2);

}  // namespace dtsdf
