/// Marching cubes tables, derived at compile time from the geometry of the cube.
///
/// Corner c of a mesh unit lies at (c & 1, c >> 1 & 1, c >> 2 & 1). A marching cubes case is an
/// index from 0 to 255 in which bit c is set if corner c is behind the surface (negative distance).
/// Edge e runs along axis e / 4.
///
/// On each face, the contour cuts off each run of corners behind the surface separately. This
/// depends on the face alone, so neighbouring units agree. The contours of all faces join into
/// closed loops, each of which bounds one component of the surface. Each loop is triangulated as a
/// fan that starts where none of its diagonals lies on a face of the cube: a diagonal on a face
/// could coincide with a neighbour's side or diagonal, which would then be shared by four
/// triangles.
#pragma once

#include <cstdint>

#include "kernels/meshing/corner_grid.h"

namespace dtsdf {

constexpr int kCubeCorners = 8;
constexpr int kCubeEdges = 12;
constexpr int kMaxComponents = 4;
constexpr int kMaxTriangles = 5;
constexpr int kFallingBit = 24;

/// Corner at the lower end of an edge; the upper end is that corner with bit (e / 4) set. Its bits
/// are those of e % 4 with a 0 inserted as bit e / 4.
DTSDF_HD constexpr int edgeLowerCorner(int e) {
  return e < 4 ? (e & 3) << 1 : (e < 8 ? (e & 1) | (e & 2) << 1 : e & 3);
}

/// Index in the corner grid of edge e (0 to 11) of the block's first unit; the unit's case `index`
/// determines the facing.
DTSDF_HD constexpr int firstUnitEdge(int e, int index) {
  const int lower = edgeLowerCorner(e);
  return edgeNumber(cornerIndex(lower & 1, lower >> 1 & 1, lower >> 2 & 1), e / 4,
                    (index >> lower & 1) ? 0 : 1);
}

struct MeshTables {
  /// Triangles of each case: three edges each, counter-clockwise when viewed from the front.
  uint8_t triangle_count[256];
  uint8_t triangle_edge[256][3 * kMaxTriangles];
  uint16_t grid_edge[256][3 * kMaxTriangles];  ///< firstUnitEdge() of each edge.
  /// Separate surface components of each case; a component is stored as the case that consists of
  /// it alone.
  uint8_t component_count[256];
  uint8_t component[256][kMaxComponents];
  /// Edges crossed by the surface of each case: bit 8 * axis + lower corner if the edge's lower
  /// corner is behind the surface (the edge faces +axis), shifted up by kFallingBit if its upper
  /// corner is behind.
  uint64_t crossings[256];
  /// Directions in which a component with this case is possible, bit d for direction d. By the
  /// intra-directional filter (paper, Sec. V-B), a component is impossible in direction D if it
  /// crosses an edge along D whose +D end is behind and whose -D end is in front.
  uint8_t seen_from[256];
};

namespace mesh_tables_detail {

constexpr int edgeBetween(int a, int b) {
  const int axis = (a ^ b) == 1 ? 0 : ((a ^ b) == 2 ? 1 : 2);
  const int lower = a < b ? a : b;
  for (int e = 4 * axis; e < 4 * axis + 4; ++e) {
    if (edgeLowerCorner(e) == lower) return e;
  }
  return -1;
}

/// Corner i (0 to 3) of the face perpendicular to `axis` at its low or high end, counter-clockwise
/// when viewed from outside.
constexpr int faceCorner(int axis, int high, int i) {
  const int u = 1 << ((axis + 1) % 3), v = 1 << ((axis + 2) % 3);
  const int turn = high ? i : (4 - i) % 4;  // opposite faces run the other way round
  const int in_plane = turn == 0 ? 0 : (turn == 1 ? u : (turn == 2 ? u + v : v));
  return in_plane + (high ? 1 << axis : 0);
}

/// For each edge crossed by a case, finds the next edge of the contour loop; -1 for other edges.
constexpr void traceContours(int index, int (&next)[kCubeEdges]) {
  for (int& edge : next) edge = -1;
  for (int face = 0; face < 6; ++face) {
    int corner[4] = {};
    for (int i = 0; i < 4; ++i) corner[i] = faceCorner(face / 2, face % 2, i);
    for (int i = 0; i < 4; ++i) {
      const bool enters = !(index >> corner[i] & 1) && (index >> corner[(i + 1) % 4] & 1);
      if (!enters) continue;
      int last = (i + 1) % 4;  // last corner behind in this run
      while (index >> corner[(last + 1) % 4] & 1) last = (last + 1) % 4;
      next[edgeBetween(corner[i], corner[(i + 1) % 4])] =
          edgeBetween(corner[last], corner[(last + 1) % 4]);
    }
  }
}

/// The faces that an edge lies on, one bit each: -x, +x, -y, +y, -z, +z.
constexpr unsigned facesOfEdge(int e) {
  unsigned faces = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != e / 4) faces |= 1u << (2 * axis + (edgeLowerCorner(e) >> axis & 1));
  }
  return faces;
}

/// First position in a loop at which a fan can start without a diagonal on a face of the cube; 0 if
/// there is none.
constexpr int fanStart(const int (&loop)[kCubeEdges], int length) {
  for (int start = 0; start < length; ++start) {
    bool on_face = false;
    for (int i = 2; i + 1 < length; ++i) {
      const int other = loop[(start + i) % length];
      on_face = on_face || (facesOfEdge(loop[start]) & facesOfEdge(other)) != 0;
    }
    if (!on_face) return start;
  }
  return 0;
}

/// The case with a single loop: the corners behind the loop, found by a flood fill along the cube's
/// edges that the loop does not cross.
constexpr int componentIndex(int index, unsigned loop_edges) {
  int behind = 0;
  for (int e = 0; e < kCubeEdges; ++e) {
    const int lower = edgeLowerCorner(e), upper = lower | 1 << (e / 4);
    if (loop_edges >> e & 1) behind |= (index >> lower & 1) ? 1 << lower : 1 << upper;
  }
  for (int pass = 0; pass < kCubeCorners; ++pass) {
    for (int e = 0; e < kCubeEdges; ++e) {
      if (loop_edges >> e & 1) continue;
      const int both = 1 << edgeLowerCorner(e) | 1 << (edgeLowerCorner(e) | 1 << (e / 4));
      if (behind & both) behind |= both;
    }
  }
  return behind;
}

constexpr MeshTables make() {
  MeshTables tables{};
  for (int index = 0; index < 256; ++index) {
    int next[kCubeEdges] = {};
    traceContours(index, next);
    unsigned done = 0;
    for (int start = 0; start < kCubeEdges; ++start) {
      if (next[start] < 0 || (done >> start & 1)) continue;
      int loop[kCubeEdges] = {}, length = 0;
      unsigned loop_edges = 0;
      for (int e = start; length == 0 || e != start; e = next[e]) {
        loop[length++] = e;
        loop_edges |= 1u << e;
      }
      const int fan = fanStart(loop, length);
      for (int i = 1; i + 1 < length; ++i) {
        const int first = 3 * tables.triangle_count[index]++;
        for (int k = 0; k < 3; ++k) {
          const int e = loop[(k == 0 ? fan : fan + i + k - 1) % length];
          tables.triangle_edge[index][first + k] = static_cast<uint8_t>(e);
          tables.grid_edge[index][first + k] = static_cast<uint16_t>(firstUnitEdge(e, index));
        }
      }
      done |= loop_edges;
      tables.component[index][tables.component_count[index]++] =
          static_cast<uint8_t>(componentIndex(index, loop_edges));
    }
    for (int axis = 0; axis < 3; ++axis) {
      const unsigned lower_corners = axis == 0 ? 0x55u : (axis == 1 ? 0x33u : 0x0Fu);
      const unsigned lower = index & lower_corners, upper = index >> (1 << axis) & lower_corners;
      const uint64_t rising = lower & ~upper, falling = upper & ~lower;
      tables.crossings[index] |= (rising | falling << kFallingBit) << (8 * axis);
      tables.seen_from[index] |= ((falling == 0 ? 1 : 0) | (rising == 0 ? 2 : 0)) << (2 * axis);
    }
  }
  return tables;
}

}  // namespace mesh_tables_detail

inline constexpr MeshTables kMeshTables = mesh_tables_detail::make();

/// Removes a component from a case: the corners that only this component separates from the others
/// change sides.
DTSDF_HD uint8_t removeComponent(uint8_t index, uint8_t component) {
  const uint8_t behind_side = component, front_side = static_cast<uint8_t>(~component);
  const bool behind_uniform = (behind_side & static_cast<uint8_t>(~index)) == 0;
  return index ^ (behind_uniform ? behind_side : front_side);
}

}  // namespace dtsdf
