/// Outlines: the boundary lines of a mesh, which are mended and smoothed.
///
/// - A **crumb** is a piece of a few triangles near a larger piece, mostly noise. It is left out.
/// - A short outline surrounds a **hole**, left by units in which no direction is active. It is
///   closed.
/// - A **crack** lies between two outlines, or two parts of one, that face each other. Bridges from
///   vertex to vertex divide it into holes.
/// - A mesh ends with whole units, so outlines have teeth of a voxel where images disagree about
///   the last units. The teeth average out, so vertices are smoothed along them with the
///   weights (-1 4 10 4 -1) / 16, which keep straight and evenly curved lines but remove teeth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "dtsdf_mapping/geometry.h"
#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// Drops vertices that no triangle has.
void dropUnusedVertices(Mesh& mesh);

/// Mends the outlines of a mesh. Its vertices, numbered from 0, and its triangles are added one by
/// one. mend() processes the whole mesh. Otherwise call link(), removeCrumbs(), close() and
/// smoothed() in this order, each for any number of vertices at a time. Vertices can be forgotten
/// from the front; `positions` and `normals` then start at the first one kept. A step reads what
/// the previous one did to vertices up to a block's length away, removeCrumbs() and close() up to
/// two.
class Outline {
 public:
  using Triangle = std::array<uint32_t, 3>;

  enum class Kind : uint8_t {
    kPlain,
    kMiddle,  ///< The midpoint of a side of a refined mesh: it moves with the side's ends.
    kFixed,   ///< It stays in place, since some triangles around it are missing.
  };

  /// Mends a mesh whose vertices and triangles were added; `normals` may have any length. Drops
  /// vertices without triangles. @param voxel Edge of a voxel in units of `vertices_m`.
  void mend(Mesh& mesh, float voxel);

  void reserve(size_t vertices) { vertices_.reserve(vertices); }
  void addVertex(Kind kind) { vertices_.push_back({0, kNone, kind, false}); }
  void addTriangle(const Triangle& triangle);

  /// Forgets the vertices before number `first`.
  void forget(uint32_t first);

  /// Lists the triangles around each of the vertices [first, end) that lies on an outline or is a
  /// midpoint. @pre All of these were added. @param triangles At least these.
  void link(uint32_t first, uint32_t end, const std::vector<Triangle>& triangles);

  /// Removes the crumbs whose first vertex on an outline is in [first, end). @param positions,
  /// voxel See close().
  void removeCrumbs(uint32_t first, uint32_t end, const std::vector<Vec3f>& positions, float voxel);
  /// Whether a triangle belongs to a crumb.
  bool isCrumb(const Triangle& triangle) const;
  /// Whether a vertex belongs to no triangles but those of crumbs.
  bool isUnused(uint32_t vertex) const;

  /// Closes the holes and the parts of cracks whose first vertex is in [first, end): loops of at
  /// most eight edges, not counting midpoints, that can be filled with triangles facing the same
  /// way as their vertices. (So the rim of a small piece is not a hole.)
  /// @param normals One per vertex, of any length. @param voxel Edge of a voxel in units of
  /// `positions`. @param add Receives the new triangles.
  void close(uint32_t first, uint32_t end, const std::vector<Vec3f>& positions,
             const std::vector<Vec3f>& normals, float voxel,
             const std::function<void(const Triangle&)>& add);

  /// The smoothed position of a vertex. @param positions One per vertex, before smoothing.
  Vec3f smoothed(uint32_t vertex, const std::vector<Vec3f>& positions) const;

 private:
  static constexpr uint32_t kNone = UINT32_MAX;
  static constexpr size_t kForwards = 0, kBackwards = 1;  ///< Ways along an outline.

  /// A triangle at a vertex: its other two vertices, counter-clockwise.
  struct Link {
    uint32_t next, previous;
    bool operator==(const Link& b) const { return next == b.next && previous == b.previous; }
  };

  /// The fans of triangles around a vertex. The outline comes from `last` of one fan and goes on to
  /// `first` of it; a gap lies between the last vertex of a fan and the first of the next.
  struct Fans {
    int count = -1;                                    ///< 0: none, or more than two; -1: unknown.
    std::array<std::array<uint32_t, 2>, 2> ends = {};  ///< First and last vertex of two fans.
  };

  /// What surrounds a vertex on an outline, or a midpoint.
  struct Rim {
    std::vector<Link> links;  ///< Those that close() adds come last.
    int own = 0;              ///< Number of the other links.
    Fans fans[2];             ///< Without and with the links of close().
    uint32_t bridge = kNone;  ///< The nearest vertex across a crack.
  };

  struct Vertex {
    /// Sum over triangles of hash(next) - hash(previous): 0 if they surround the vertex.
    uint32_t sum;
    uint32_t rim;  ///< Number of its rim; kNone: it has none.
    Kind kind;
    bool is_used;  ///< Whether a triangle has it, if it has no rim.
  };

  struct Surface;
  struct BridgeEnd;
  using Loop = std::vector<uint32_t>;

  Vertex& at(uint32_t number) { return vertices_[number - first_]; }
  const Vertex& at(uint32_t number) const { return vertices_[number - first_]; }
  Rim& rimOf(uint32_t vertex) const { return rims_[at(vertex).rim - first_rim_]; }
  bool hasRim(uint32_t number) const { return at(number).rim != kNone; }
  bool hasEdge(uint32_t a, uint32_t b) const;
  static Fans fansOfLinks(const Link* links, int count);
  const Fans& fansOf(uint32_t vertex, bool is_closed = false) const;
  uint32_t beside(uint32_t vertex, size_t way) const;
  uint32_t nextOnEdge(uint32_t vertex, size_t way) const;
  uint32_t alongHole(uint32_t before, uint32_t vertex, size_t way) const;
  std::vector<std::vector<Triangle>> smallPieces() const;
  bool growPiece(uint32_t first, std::vector<Triangle>& crumb) const;
  bool hasMidpoint(const std::vector<Triangle>& piece) const;
  void removeTriangle(const Triangle& triangle);
  int halvesOf(uint32_t vertex, uint32_t next) const;
  bool leads(uint32_t from, uint32_t to, size_t way, int max_edges) const;
  std::vector<BridgeEnd> bridgeEnds(const Surface& surface) const;
  bool isBridge(const BridgeEnd& end, const BridgeEnd& other, const Surface& surface) const;
  void findBridges(const Surface& surface);
  uint32_t bridgeFrom(uint32_t vertex) const;
  bool followLoop(uint32_t lowest, uint32_t vertex, uint32_t next, Loop& loop) const;
  bool cutCorner(Loop& loop, const Surface& surface, std::vector<Triangle>& triangles) const;
  Vec3f shiftOf(uint32_t vertex, const std::vector<Vec3f>& positions) const;

  uint32_t first_ = 0;      ///< Number of vertices_[0].
  uint32_t first_rim_ = 0;  ///< Number of rims_[0].
  std::vector<Vertex> vertices_;
  mutable std::deque<Rim> rims_;  ///< In order of their vertices. Fans are computed on first use.
};

}  // namespace dtsdf
