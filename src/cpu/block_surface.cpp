#include "cpu/block_surface.h"

#include <algorithm>
#include <cstring>
#include <iterator>

namespace dtsdf {
namespace {

static_assert(kLatticeEdges <= 65536, "edges are kept in 16 bits");

int lowestBit(uint64_t bits) { return __builtin_ctzll(bits); }

bool hasSurface(const UnitIndices* row) {
  uint64_t words[2];
  static_assert(sizeof(words) == kBlockSide * sizeof(UnitIndices), "");
  std::memcpy(words, row, sizeof(words));
  return (words[0] | words[1]) != 0;
}

/// The samples of one end of an edge, by direction.
struct EdgeEnd {
  const Voxel* const* arrays;
  int voxel;
  int direction;  ///< That the undirected map's only array counts as; -1 in the directional map.

  Voxel operator[](int d) const {
    if (direction >= 0 && d != direction) return {0.0f, 0.0f};
    const Voxel* voxels = arrays[direction >= 0 ? 0 : d];
    return voxels == nullptr ? Voxel{0.0f, 0.0f} : voxels[voxel];
  }
};

struct LatticeEdge {
  EdgeEnd lower, upper;
};

BlockVertex makeVertex(const LatticeArrays& arrays, int edge, bool directional) {
  const int corner = edgeCorner(edge), axis = edgeAxis(edge), facing = edgeFacing(edge);
  const LatticeSource lower = latticeSource(corner);
  const LatticeSource upper = latticeSource(corner + latticeStride(axis));
  const int direction = directional ? -1 : directionOnEdge(0, axis, facing, false);
  const LatticeEdge samples{{arrays.array[lower.block], lower.voxel, direction},
                            {arrays.array[upper.block], upper.voxel, direction}};
  return {vertexPosition(edge, edgeOffset(samples, axis, facing)), static_cast<uint32_t>(edge)};
}

}  // namespace

void BlockSurface::collect(const IndexNeighbourhood& indices) {
  static const UnitIndices kNothing[kVoxelsPerBlock] = {};
  for (int n = 0; n < kRegularisationReach; ++n) {
    const UnitIndices* from = indices[n] == nullptr ? kNothing : indices[n];
    const Vec3i at = regularisationOffset(n);
    // The part of the neighbour's units that lies in the grid, and where it lies there.
    const Vec3i first{at.x < 0 ? kBlockSide - 1 : 0, at.y < 0 ? kBlockSide - 1 : 0,
                      at.z < 0 ? kBlockSide - 1 : 0};
    const Vec3i count{at.x ? 1 : kBlockSide, at.y ? 1 : kBlockSide, at.z ? 1 : kBlockSide};
    for (int z = first.z; z < first.z + count.z; ++z) {
      for (int y = first.y; y < first.y + count.y; ++y) {
        const UnitIndices* row = from + voxelIndex(first.x, y, z);
        UnitIndices* to = grid_ + gridIndex(first.x + kBlockSide * at.x, y + kBlockSide * at.y,
                                            z + kBlockSide * at.z);
        if (at.x == 0) {
          std::copy(row, row + kBlockSide, to);
        } else {
          *to = *row;
        }
      }
    }
  }
}

void BlockSurface::addTriangles(const UnitIndices& settled, const Vec3i& unit) {
  for (const uint8_t index : settled.sheet) {
    for (int k = 0; k < 3 * kMeshTables.triangle_count[index]; ++k) {
      const int edge = unitEdge(unit, kMeshTables.triangle_edge[index][k], index);
      edge_bits_[edge / kWordBits] |= uint64_t{1} << edge % kWordBits;
      triangle_edges_.push_back(static_cast<uint16_t>(edge));
    }
  }
}

void BlockSurface::settle(const IndexNeighbourhood& indices) {
  collect(indices);
  std::fill(std::begin(edge_bits_), std::end(edge_bits_), uint64_t{0});
  triangle_edges_.clear();
  const auto at = [this](const Vec3i& unit) { return grid_[gridIndex(unit.x, unit.y, unit.z)]; };
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    if (i % kBlockSide == 0 && !hasSurface(indices[0] + i)) {
      i += kBlockSide - 1;
      continue;
    }
    if (indices[0][i].sheet[0] == 0) continue;
    const Vec3i unit = voxelOffset(i);
    addTriangles(settleUnit(at, unit), unit);
  }
}

void BlockSurface::emit(const LatticeArrays& arrays, bool directional, BlockMesh& mesh) {
  size_t vertices = 0;
  for (const uint64_t word : edge_bits_) {
    for (uint64_t rest = word; rest != 0; rest &= rest - 1) ++vertices;
  }
  mesh.vertices.reserve(vertices);
  for (int word = 0; word < kEdgeWords; ++word) {
    for (uint64_t rest = edge_bits_[word]; rest != 0; rest &= rest - 1) {
      const int edge = word * kWordBits + lowestBit(rest);
      vertex_of_edge_[edge] = static_cast<uint16_t>(mesh.vertices.size());
      mesh.vertices.push_back(makeVertex(arrays, edge, directional));
    }
  }
  mesh.triangles.resize(triangle_edges_.size());
  std::transform(triangle_edges_.begin(), triangle_edges_.end(), mesh.triangles.begin(),
                 [this](uint16_t edge) { return vertex_of_edge_[edge]; });
}

}  // namespace dtsdf
