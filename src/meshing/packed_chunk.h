/// A chunk of the mesh in the compact form used in messages. Positions are whole steps of a lattice
/// that all chunks of a map share, so that neighbouring chunks meet without cracks. For views from
/// far away, chunks can be coarsened.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "meshing/mesh_chunks.h"

namespace dtsdf {

/// The positions that chunk vertices may have: multiples of a step along each axis of W. The edge
/// of a voxel is 2^n steps long.
struct ChunkLattice {
  /// A voxel has 512 steps, or fewer if 16 bits could not span the chunk plus a margin of two
  /// voxels on each side, into which its vertices may extend.
  /// @param chunk_blocks Number of blocks along each edge of a chunk.
  ChunkLattice(float voxel_size_m, int chunk_blocks);

  int chunk_blocks;
  int steps_per_voxel;
  double step_m;
};

/// Vertices and triangles of one chunk.
struct PackedChunk {
  std::array<int64_t, 3> origin = {};  ///< Origin of the positions, in steps from the origin of W.
  std::vector<uint16_t> positions;     ///< x, y, z of each vertex, in steps from the origin.
  std::vector<int16_t> normals;        ///< Two numbers per vertex, see packedNormal().
  std::vector<uint8_t> colours;        ///< Red, green, blue of each vertex; empty if unpainted.
  std::vector<uint16_t> triangles16;   ///< Three indices each, counter-clockwise from the front.
  std::vector<uint32_t> triangles32;   ///< Used instead if there are more than 65536 vertices.

  size_t vertexCount() const { return positions.size() / 3; }
  size_t triangleCount() const { return (triangles16.size() + triangles32.size()) / 3; }
  /// Index of the vertex at a corner of a triangle; corner i of triangle t has number 3 t + i.
  uint32_t corner(size_t number) const {
    return triangles32.empty() ? triangles16[number] : triangles32[number];
  }
};

/// Packs the blocks with these packed keys, in ascending order, into the chunk whose lowest block
/// is `corner`. Unknown keys are skipped. If there are no triangles, only the chunk's origin is
/// set.
PackedChunk packChunk(const MeshStore& mesh, const ChunkLattice& lattice, const BlockKey& corner,
                      const std::vector<PackedKey>& blocks);

/// Packs several chunks on up to threadCount(threads) threads.
std::vector<PackedChunk> packChunks(const MeshStore& mesh, const ChunkLattice& lattice,
                                    const MeshChunks& chunks, const std::vector<PackedKey>& keys,
                                    int threads);

/// Checks a received chunk: the lengths of its arrays, its indices and its origin. The functions
/// below rely on these checks. @throws std::runtime_error that says what is wrong.
void checkChunk(const PackedChunk& chunk);

/// Checks a lattice's step. @throws std::runtime_error that says what is wrong.
void checkStep(double step_m);

/// Position of a vertex in W, in metres. Chunks that share a vertex give exactly the same position.
std::array<double, 3> positionOf(const PackedChunk& chunk, double step_m, size_t vertex);

/// The octahedral encoding of a unit vector: its projection onto the octahedron abs(x) + abs(y) +
/// abs(z) = 1, with the lower half folded outwards, in units of 1 / 32767.
std::array<int16_t, 2> packedNormal(const Vec3f& normal);
Vec3f normalOfPacked(int16_t u, int16_t v);

/// Unpacks a chunk. Positions become floats relative to the chunk's origin.
Mesh unpackChunk(const PackedChunk& chunk, double step_m);

/// Merges vertices in the same cell whose normals are closest to the same direction (+-x, +-y or
/// +-z), so that the two sides of a thin object stay apart. Cells are cubes of 2^cell_log2 steps on
/// the map's lattice. Merged vertices lie at the middle of their cell, shifted by a quarter of a
/// cell in their direction, so that neighbouring chunks still meet. The positions and the origin of
/// the result are in quarters of a cell. Triangles that collapse are dropped.
PackedChunk coarsen(const PackedChunk& chunk, int cell_log2);

}  // namespace dtsdf
