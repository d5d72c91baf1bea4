#include "cpu/block_surface.h"

#include <algorithm>
#include <cstring>

namespace dtsdf {
namespace {

static_assert(kGridEdges <= 65536, "edges are kept in 16 bits");

bool hasSurface(const UnitIndices* row) {
  uint64_t words[2];
  static_assert(sizeof(words) == kBlockSide * sizeof(UnitIndices), "");
  std::memcpy(words, row, sizeof(words));
  return (words[0] | words[1]) != 0;
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
        UnitIndices* to = units_ + unitIndex(first.x + kBlockSide * at.x, y + kBlockSide * at.y,
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

void BlockSurface::addTriangles(const UnitIndices& regular, const Vec3i& unit) {
  surface_units_.push_back({unit, regular});
  visitTriangleEdges(kMeshTables, regular, unit, [this](int edge) {
    edges_.add(edge);
    triangle_edges_.push_back(static_cast<uint16_t>(edge));
  });
}

void BlockSurface::regularise(const IndexNeighbourhood& indices) {
  collect(indices);
  edges_.clear();
  triangle_edges_.clear();
  surface_units_.clear();
  const auto at = [this](const Vec3i& unit) { return units_[unitIndex(unit.x, unit.y, unit.z)]; };
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    if (i % kBlockSide == 0 && !hasSurface(indices[0] + i)) {
      i += kBlockSide - 1;
      continue;
    }
    if (indices[0][i].sheet[0] == 0) continue;
    const Vec3i unit = voxelOffset(i);
    addTriangles(regulariseUnit(at, unit), unit);
  }
}

void BlockSurface::emit(const MeshRules& rules, const NearbyArrays& arrays,
                        const std::vector<BlockVertex>& known, bool directional,
                        BlockMesh& mesh) {
  mesh.vertices.reserve(edges_.count());
  auto next = known.begin();
  edges_.forEach([&](int edge) {
    vertex_of_edge_[edge] = static_cast<uint16_t>(mesh.vertices.size());
    while (next != known.end() && next->edge < static_cast<uint32_t>(edge)) ++next;
    const bool is_known = next != known.end() && next->edge == static_cast<uint32_t>(edge);
    mesh.vertices.push_back(is_known ? *next : makeVertex(rules, arrays, edge, directional));
  });
  mesh.triangles.resize(triangle_edges_.size());
  std::transform(triangle_edges_.begin(), triangle_edges_.end(), mesh.triangles.begin(),
                 [this](uint16_t edge) { return vertex_of_edge_[edge]; });
}

}  // namespace dtsdf
