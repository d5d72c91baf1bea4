#include "cpu/block_surface.h"

#include <algorithm>
#include <cstring>

namespace dtsdf {
namespace {

static_assert(kGridEdges <= 65536, "edges are kept in 16 bits");

bool anySpeaks(const UnitLabels* row) {
  uint64_t words[2];
  static_assert(sizeof(words) == kBlockSide * sizeof(UnitLabels), "");
  std::memcpy(words, row, sizeof(words));
  return (words[0] | words[1]) != 0;
}

/// Along an axis: the units of a block at such an offset that have corners in the block's grid.
struct UnitRange {
  int first, end;
};
UnitRange rangeOf(int offset) {
  if (offset < 0) return {kBlockSide - 1, kBlockSide};
  return {0, offset > 0 ? 1 : kBlockSide};
}

/// The vertex of an edge of which nothing is known.
BlockVertex makeVertex(const MeshSettings& rules, const ArraysAround& arrays, int edge,
                       bool directional) {
  const uint32_t may_cross = speakingOnEdge(edgeAxis(edge), edgeFacing(edge));
  const EdgeVoxels voxels(arrays, edge, directional, may_cross);
  return voxels.vertex(rules, voxels.crossing());
}

}  // namespace

/// What cornerBalance() gathers for a corner, spread by the units, of which most say nothing.
void BlockSurface::weighCorners(const LabelNeighbourhood& labels) {
  std::fill(balance_, balance_ + kGridCorners, int8_t{0});
  std::fill(is_given_, is_given_ + kGridCorners, uint8_t{0});
  for (int n = 0; n < kBlocksAround; ++n) {
    if (labels[n] == nullptr) continue;
    const Vec3i at = aroundOffset(n);
    const UnitRange xs = rangeOf(at.x), ys = rangeOf(at.y), zs = rangeOf(at.z);
    for (int z = zs.first; z < zs.end; ++z) {
      for (int y = ys.first; y < ys.end; ++y) {
        const UnitLabels* row = labels[n] + voxelIndex(0, y, z);
        if (!anySpeaks(row)) continue;
        for (int x = xs.first; x < xs.end; ++x) {
          addSides(row[x], {x + kBlockSide * at.x, y + kBlockSide * at.y, z + kBlockSide * at.z});
        }
      }
    }
  }
}

/// The sides that a unit gives those of its corners that lie in the block's grid.
void BlockSurface::addSides(const UnitLabels& labels, const Vec3i& unit) {
  if (saysNothing(labels)) return;
  const auto add = [&](int c, int corner) {
    const int side = sideGiven(labels, c);
    balance_[corner] = static_cast<int8_t>(balance_[corner] + side);
    is_given_[corner] |= side != 0 ? 1 : 0;
  };
  if (blockOfVoxel(unit) == BlockKey{0, 0, 0}) {  // as most: all of its corners do
    const int first = cornerIndex(unit.x, unit.y, unit.z);
    for (int c = 0; c < kCubeCorners; ++c) {
      add(c, first + cornerIndex(c & 1, c >> 1 & 1, c >> 2 & 1));
    }
    return;
  }
  const auto in_grid = [](int at) { return static_cast<unsigned>(at) < kCornerGridSide; };
  for (int c = 0; c < kCubeCorners; ++c) {
    const Vec3i corner = unit + cornerOffset(c);
    if (!(in_grid(corner.x) && in_grid(corner.y) && in_grid(corner.z))) continue;
    add(c, cornerIndex(corner.x, corner.y, corner.z));
  }
}

void BlockSurface::addTriangles(const UnitIndices& regular, const Vec3i& unit) {
  if (countTriangles(kMeshTables, regular) == 0) return;
  surface_units_.push_back({unit, regular});
  visitTriangleEdges(kMeshTables, regular, unit, [this](int edge) {
    edges_.add(edge);
    triangle_edges_.push_back(static_cast<uint16_t>(edge));
  });
}

SettledCorners BlockSurface::cornersOf(const Vec3i& unit) const {
  SettledCorners corners{0, 0};
  for (int c = 0; c < kCubeCorners; ++c) {
    const Vec3i corner = unit + cornerOffset(c);
    const int number = cornerIndex(corner.x, corner.y, corner.z);
    corners.behind |= isBehindForMost(balance_[number]) ? 1u << c : 0u;
    corners.given |= is_given_[number] != 0 ? 1u << c : 0u;
  }
  return corners;
}

/// False only where so few corners get a side that no surface is between them.
bool BlockSurface::mayClose(const Vec3i& unit) const {
  const int first = cornerIndex(unit.x, unit.y, unit.z);
  const auto given = [&](int x, int y, int z) { return is_given_[first + cornerIndex(x, y, z)]; };
  return (given(0, 0, 0) | given(1, 0, 0) | given(0, 1, 1) | given(1, 1, 1)) != 0;
}

/// False only where mayClose() is for all units of a row.
bool BlockSurface::mayCloseRow(const Vec3i& first_unit) const {
  const uint8_t* const lower = is_given_ + cornerIndex(0, first_unit.y, first_unit.z);
  const uint8_t* const upper = is_given_ + cornerIndex(0, first_unit.y + 1, first_unit.z + 1);
  unsigned given = 0;
  for (int x = 0; x < kCornerGridSide; ++x) given |= lower[x] | upper[x];
  return given != 0;
}

void BlockSurface::addUnits(const LabelNeighbourhood& labels, const BlockBits& loose,
                            bool directional) {
  edges_.clear();
  triangle_edges_.clear();
  surface_units_.clear();
  holding_surface_ = {};
  constexpr Vec3i kMiddle{0, 0, 0};
  const auto at = [&](const Vec3i& unit) {
    const UnitSource source = unitSource(unit);
    const bool is_left_out = source.block == aroundNumber(kMiddle) && hasUnit(loose, unit);
    const UnitLabels* block = labels[source.block];
    return block == nullptr || is_left_out ? UnitLabels{0, 0} : block[source.unit];
  };
  const UnitLabels* own = labels[aroundNumber(kMiddle)];
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i unit = voxelOffset(i);
    if (unit.x == 0 && !anySpeaks(own + i) && !(directional && mayCloseRow(unit))) {
      i += kBlockSide - 1;
      continue;
    }
    if (saysNothing(own[i]) && !(directional && mayClose(unit))) continue;
    if (hasUnit(loose, unit)) continue;
    if (holdsSurface(own[i])) addUnit(holding_surface_, unit);
    addTriangles(settledIndices(kMeshTables, at, unit, cornersOf(unit), directional), unit);
  }
}

void BlockSurface::regularise(const LabelNeighbourhood& labels, int most_loose_units,
                              bool directional) {
  weighCorners(labels);
  addUnits(labels, {}, directional);
  const BlockBits loose = looseUnits(holding_surface_, labels, most_loose_units);
  if (loose != BlockBits{})
    addUnits(labels, loose, directional);  // once more, as few blocks have any
}

void BlockSurface::emit(const MeshSettings& rules, const ArraysAround& arrays,
                        const std::vector<BlockVertex>& known, bool directional, BlockMesh& mesh) {
  mesh.vertices.reserve(edges_.count());
  drawn_vertices_.clear();
  is_drawn_.clear();
  auto next = known.begin();
  edges_.forEach([&](int edge) {
    vertex_of_edge_[edge] = static_cast<uint16_t>(mesh.vertices.size());
    while (next != known.end() && next->edge < static_cast<uint32_t>(edge)) ++next;
    const bool is_known = next != known.end() && next->edge == static_cast<uint32_t>(edge);
    mesh.vertices.push_back(is_known ? *next : makeVertex(rules, arrays, edge, directional));
    drawn_vertices_.push_back(drawnVertex(mesh.vertices.back()));
    is_drawn_.push_back(isDrawn(drawn_vertices_.back()));
  });
  mesh.triangles.resize(triangle_edges_.size());
  std::transform(triangle_edges_.begin(), triangle_edges_.end(), mesh.triangles.begin(),
                 [this](uint16_t edge) { return vertex_of_edge_[edge]; });
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    uint16_t* triangle = mesh.triangles.data() + i;
    const uint16_t a = triangle[0], b = triangle[1], c = triangle[2];
    const bool may_be_gap = is_drawn_[a] | is_drawn_[b] | is_drawn_[c];
    if (may_be_gap &&
        standsInGap(rules, drawn_vertices_[a], drawn_vertices_[b], drawn_vertices_[c])) {
      std::fill(triangle, triangle + 3, kGapVertex);
    }
  }
}

}  // namespace dtsdf
