/// The outlines of a mesh: its boundary lines, with the triangles around the vertices on them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dtsdf {

/// Vertices (indexed from 0) and triangles are added one by one. Then link() gives a rim to each
/// vertex on an outline, and to each midpoint. Vertices can be forgotten from the front.
class Outline {
 public:
  using Triangle = std::array<uint32_t, 3>;
  static constexpr uint32_t kNone = UINT32_MAX;
  static constexpr size_t kForwards = 0, kBackwards = 1;  ///< Ways along an outline.

  enum class Kind : uint8_t {
    kPlain,
    kMiddle,  ///< The midpoint of a side of a refined mesh: moves with the side's ends.
    kFixed,   ///< Stays in place and has no rim, since some triangles around it are missing.
  };

  /// A triangle at a vertex: its other two vertices, counter-clockwise.
  struct Link {
    uint32_t next, previous;
  };

  /// The links around a vertex, and the fans (rows of adjacent triangles) that they form. The
  /// outline runs from the last vertex of a fan through this vertex to the fan's first vertex. A
  /// gap lies between the last vertex of a fan and the first of the next. Patches, which are
  /// added by patch(), change only the links and `beside`.
  struct Rim {
    using Fan = std::array<uint32_t, 2>;  ///< First and last vertex.

    uint32_t vertex;
    uint32_t first_link;
    uint32_t own = 0;              ///< Number of links, not counting those of patches.
    uint32_t links = 0;            ///< Number of all links; those of patches come last.
    uint32_t fan_count = 0;        ///< 0 if there is none, or more than two.
    std::array<Fan, 2> fans = {};  ///< The fans, ignoring patches.
    Fan beside = {kNone, kNone};   ///< The fan including patches, if there is exactly one.
  };

  void reserve(size_t vertices) { vertices_.reserve(vertices); }
  void addVertex(Kind kind) { vertices_.push_back({0, kNone, 0, kind}); }
  void addTriangle(const Triangle& triangle);

  /// Forgets the vertices before index `first`.
  void forget(uint32_t first);

  /// Builds the rims of the vertices [first, end). @pre All triangles around these vertices have
  /// been added.
  /// @param triangles Must include all triangles around these vertices.
  void link(uint32_t first, uint32_t end, const std::vector<Triangle>& triangles);

  /// Marks a vertex as unused, without fans. Its links are kept.
  void clear(uint32_t vertex);
  /// Adds a triangle that closes a part of a hole. @pre Its vertices have rims.
  void patch(const Triangle& triangle);

  /// Index of the first vertex that is not forgotten, and one past the last vertex.
  uint32_t first() const { return first_; }
  uint32_t end() const { return first_ + static_cast<uint32_t>(vertices_.size()); }
  Kind kind(uint32_t vertex) const { return at(vertex).kind; }
  /// Whether a vertex is not fully surrounded by triangles.
  bool isOnOutline(uint32_t vertex) const { return at(vertex).sum != 0; }
  bool isUnused(uint32_t vertex) const { return at(vertex).triangles == 0; }
  bool hasRim(uint32_t vertex) const { return at(vertex).rim != kNone; }

  const std::vector<Rim>& rims() const { return rims_; }  ///< Sorted by vertex.
  /// Index in rims() of the first rim at `vertex` or a later vertex.
  size_t rimFrom(uint32_t vertex) const;
  /// Index in rims() of a vertex's rim. @pre The vertex has a rim.
  size_t rimNumber(uint32_t vertex) const { return at(vertex).rim - first_rim_; }
  const Rim& rimOf(uint32_t vertex) const { return rims_[rimNumber(vertex)]; }
  const Link* linksOf(const Rim& rim) const { return &links_[rim.first_link]; }

  /// Whether a triangle has an edge between two vertices; patches do not count. @pre `a` has a rim.
  bool hasEdge(uint32_t a, uint32_t b) const;

  /// The vertex that follows `vertex` around a hole when coming from `before`, ignoring patches.
  /// Where two fans meet, a hole lies between them. kNone if the vertex is fixed or more than two
  /// fans meet.
  uint32_t alongHole(uint32_t before, uint32_t vertex, size_t way) const {
    if (vertex < first_ || !hasRim(vertex)) return kNone;
    const Rim& rim = rimOf(vertex);
    for (uint32_t i = 0; i < rim.fan_count; ++i) {
      if (rim.fans[i][1 - way] == before) return rim.fans[rim.fan_count - 1 - i][way];
    }
    return kNone;
  }

  /// The next vertex on the outline, including patches. kNone if the outline ends there or meets
  /// another outline.
  uint32_t beside(uint32_t vertex, size_t way) const {
    return vertex < first_ || !hasRim(vertex) ? kNone : rimOf(vertex).beside[way];
  }

 private:
  struct Vertex {
    /// Sum over triangles of hash(next) - hash(previous): 0 if they surround the vertex.
    uint32_t sum;
    uint32_t rim;        ///< Index of its rim; kNone if it has none.
    uint16_t triangles;  ///< Number of triangles around it, not counting patches.
    Kind kind;
  };

  Vertex& at(uint32_t vertex) { return vertices_[vertex - first_]; }
  const Vertex& at(uint32_t vertex) const { return vertices_[vertex - first_]; }
  uint32_t findFans(const Rim& rim, std::array<Rim::Fan, 2>& fans) const;

  uint32_t first_ = 0;      ///< Index of vertices_[0].
  uint32_t first_rim_ = 0;  ///< Index of rims_[0].
  std::vector<Vertex> vertices_;
  std::vector<Rim> rims_;
  std::vector<Link> links_;  ///< The links of each rim are contiguous.
};

}  // namespace dtsdf
