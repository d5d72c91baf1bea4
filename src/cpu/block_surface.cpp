#include "cpu/block_surface.h"

#include <algorithm>
#include <cstring>

#include "cpu/widest_vectors.h"

namespace dtsdf {
namespace {

static_assert(kGridEdges <= 65536, "edge indices must fit in 16 bits");

bool hasSurface(const UnitLabels* row) {
  uint64_t words[2];
  static_assert(sizeof(words) == kBlockSide * sizeof(UnitLabels), "");
  std::memcpy(words, row, sizeof(words));
  return (words[0] | words[1]) != 0;
}

/// Range, along an axis, of those units of a neighbouring block that share corners with the central
/// block. `offset` is the neighbour's offset along that axis.
int firstSharedUnit(int offset) { return offset < 0 ? kBlockSide - 1 : 0; }
int endSharedUnit(int offset) { return offset > 0 ? 1 : kBlockSide; }

/// For each corner c of a unit, 1 in bits 8 c to 8 c + 7 if bit c of `corners` is set.
uint64_t onePerCorner(unsigned corners) {
  constexpr uint64_t kOnes = 0x0101010101010101, kOwnBits = 0x8040201008040201;
  return ((corners * kOnes & kOwnBits) + 0x7f * kOnes) >> 7 & kOnes;
}

}  // namespace

/// Finds the corners that are behind the surface by majority (cornerBalance()). Loops over units,
/// most of which are empty and skipped.
inline void BlockSurface::findMajorities(const LabelNeighbourhood& labels) {
  std::fill(is_behind_, is_behind_ + kGridCorners, uint8_t{0});
  for (int n = 0; n < kBlocksAround; ++n) {
    if (labels[n] == nullptr) continue;
    const Vec3i at = aroundOffset(n), to_block = firstVoxelOfBlock(at);
    const Vec3i first{firstSharedUnit(at.x), firstSharedUnit(at.y), firstSharedUnit(at.z)};
    const Vec3i end{endSharedUnit(at.x), endSharedUnit(at.y), endSharedUnit(at.z)};
    for (int z = first.z; z < end.z; ++z) {
      for (int y = first.y; y < end.y; ++y) {
        const UnitLabels* row = labels[n] + voxelIndex(0, y, z);
        if (!hasSurface(row)) continue;
        for (int x = first.x; x < end.x; ++x) {
          if (!isEmpty(row[x])) countSides(row[x], to_block + Vec3i{x, y, z});
        }
      }
    }
  }
  for (uint8_t& units : is_behind_) units = isMajorityBehind((units & 15) - (units >> 4)) ? 1 : 0;
}

/// Counts a unit at those of its corners that are in the block's grid: in the lower four bits if
/// the corner is behind the unit's sheets, in the upper four if it is in front.
inline void BlockSurface::countSides(const UnitLabels& labels, const Vec3i& unit) {
  const uint64_t sides = onePerCorner(cornersBehind(labels)) | onePerCorner(cornersInFront(labels))
                                                                   << 4;
  const auto add = [&](int c, int corner) {
    is_behind_[corner] = static_cast<uint8_t>(is_behind_[corner] + (sides >> 8 * c));
  };
  if (blockOfVoxel(unit) == BlockKey{0, 0, 0}) {  // all its corners are in the grid
    const int first = cornerIndex(unit.x, unit.y, unit.z);
#pragma GCC unroll 8  // shifts by constants
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

inline void BlockSurface::addTriangles(const UnitIndices& regular, const Vec3i& unit) {
  if (countTriangles(kMeshTables, regular) == 0) return;
  surface_units_.emplace_back(unit, regular);
  edges_.addUnit(regular, unit);
}

void BlockSurface::regularise(const LabelNeighbourhood& labels) {
  withWidestVectors([&] { findMajorities(labels); });
  edges_.clear();
  surface_units_.clear();
  const UnitLabels* own = labels[aroundNumber({0, 0, 0})];
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    if (i % kBlockSide == 0 && !hasSurface(own + i)) {
      i += kBlockSide - 1;
      continue;
    }
    if (isEmpty(own[i])) continue;
    const Vec3i unit = voxelOffset(i);
    const uint8_t* const first = is_behind_ + cornerIndex(unit.x, unit.y, unit.z);
    unsigned behind = 0;
#pragma GCC unroll 8
    for (int c = 0; c < kCubeCorners; ++c) {
      behind |= unsigned{first[cornerIndex(c & 1, c >> 1 & 1, c >> 2 & 1)]} << c;
    }
    addTriangles(dtsdf::regularise(own[i], behind), unit);
  }
}

void BlockSurface::emit(const MeshSettings& rules, const ArraysAround& arrays,
                        const std::vector<BlockVertex>& known, bool directional, BlockMesh& mesh) {
  mesh.vertices.reserve(edges_.count());
  auto next = known.begin();
  edges_.forEach([&](int edge) {
    vertex_of_edge_[edge] = static_cast<uint16_t>(mesh.vertices.size());
    while (next != known.end() && next->edge < static_cast<uint32_t>(edge)) ++next;
    const bool is_known = next != known.end() && next->edge == static_cast<uint32_t>(edge);
    const uint32_t may_cross = directionsOnEdge(edgeAxis(edge), edgeFacing(edge));
    BlockVertex& vertex = mesh.vertices.emplace_back();
    vertex.edge = static_cast<uint32_t>(edge);
    vertex.position =
        is_known ? next->position : placeVertex(rules, arrays, edge, directional, may_cross);
    is_pulled_far_[vertex_of_edge_[edge]] = isPulledFar(rules, vertex);
  });
  size_t triangles = 0;
  for (const auto& [unit, indices] : surface_units_) {
    triangles += countTriangles(kMeshTables, indices);
  }
  mesh.triangles.resize(3 * triangles);
  uint16_t* next_corner = mesh.triangles.data();
  for (const auto& [unit, indices] : surface_units_) {
    visitTriangleEdges(kMeshTables, indices, unit,
                       [&](int edge) { *next_corner++ = vertex_of_edge_[edge]; });
  }
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    uint16_t* triangle = mesh.triangles.data() + i;
    const uint16_t a = triangle[0], b = triangle[1], c = triangle[2];
    const bool may_be_gap = is_pulled_far_[a] | is_pulled_far_[b] | is_pulled_far_[c];
    if (may_be_gap && spansGap(rules, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c])) {
      std::fill(triangle, triangle + 3, kGapVertex);
    }
  }
}

std::vector<Vec3f> vertexNormals(const ArraysAround& arrays,
                                 const std::vector<BlockVertex>& vertices, bool directional) {
  std::vector<Vec3f> normals;
  normals.reserve(vertices.size());
  for (const BlockVertex& vertex : vertices) {
    normals.push_back(
        vertexNormal(arrays, static_cast<int>(vertex.edge), vertex.position, directional));
  }
  return normals;
}

void BlockSurface::findNormals(const ArraysAround& arrays, const std::vector<BlockVertex>& known,
                               const std::vector<Vec3f>& normals, bool directional,
                               const BlockMesh& mesh) {
  normals_.clear();
  size_t next = 0;
  for (const BlockVertex& vertex : mesh.vertices) {
    while (next < known.size() && known[next].edge < vertex.edge) ++next;
    const bool is_known = next < known.size() && known[next].edge == vertex.edge;
    normals_.push_back(is_known ? normals[next]
                                : vertexNormal(arrays, static_cast<int>(vertex.edge),
                                               vertex.position, directional));
  }
}

void BlockSurface::addMidpoints(const Vec3i& unit, const UnitIndices& indices,
                                BlockMesh& mesh) const {
  const auto endOn = [&](int edge) {
    const uint16_t vertex = vertex_of_edge_[edge];
    return SideEnd{mesh.vertices[vertex].position, normals_[vertex]};
  };
  visitSides(kRefineTables, indices, unit, [&](int a, int b) {
    mesh.vertices.push_back({midpointOfSide(endOn(a), endOn(b)), midpointNumber(a, b)});
  });
}

void BlockSurface::refine(const MeshSettings& rules, const ArraysAround& arrays,
                          const std::vector<BlockVertex>& known, const std::vector<Vec3f>& normals,
                          bool directional, BlockMesh& mesh) {
  findNormals(arrays, known, normals, directional, mesh);
  size_t middles = 0;
  for (const auto& [unit, indices] : surface_units_) {
    middles += sidesOfUnit(kRefineTables, indices);
  }
  mesh.vertices.reserve(mesh.vertices.size() + middles);
  const size_t triangle_corners = kRefinedTriangles * mesh.triangles.size();
  mesh.triangles.clear();
  mesh.triangles.reserve(triangle_corners);
  for (const auto& [unit, indices] : surface_units_) {
    const uint32_t first_middle = static_cast<uint32_t>(mesh.vertices.size());
    addMidpoints(unit, indices, mesh);
    visitRefinedTriangles(
        kMeshTables, kRefineTables, indices, unit, first_middle,
        [&](int edge) { return uint32_t{vertex_of_edge_[edge]}; },
        [&](const uint32_t(&corner)[3]) {
          return spansGap(rules, mesh.vertices[corner[0]], mesh.vertices[corner[1]],
                          mesh.vertices[corner[2]]);
        },
        [&](uint32_t vertex) { mesh.triangles.push_back(static_cast<uint16_t>(vertex)); });
  }
}

}  // namespace dtsdf
