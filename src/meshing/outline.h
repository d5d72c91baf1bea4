/// Outlines: the lines along which a mesh ends.
///
/// A short one goes around a hole where a unit says nothing: it is closed.
///
/// A mesh ends with a whole unit, so where images disagree about the last ones a longer one is a
/// saw with teeth of a voxel. What they measured of it is right on average, so its vertices go to a
/// mean along it, by the weights (-1 4 10 4 -1) / 16: straight and evenly bent lines stay, teeth
/// go.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// Follows the outlines of a mesh whose vertices and triangles come one after the other. Vertices
/// are numbered from 0.
class Outline {
 public:
  using Triangle = std::array<uint32_t, 3>;

  enum class Kind : uint8_t {
    kPlain,
    kMiddle,  ///< The midpoint of a side of a refined mesh: it goes along with the side's ends.
    kFixed,   ///< It stays, as not all triangles around it are here.
  };

  void reserve(size_t vertices) { vertices_.reserve(vertices); }
  void addVertex(Kind kind) { vertices_.push_back({0, 0, {0, 0}, kind, 0, false}); }
  void addTriangle(const Triangle& triangle);

  /// Forgets the first vertices; the numbers of the others are less by so many.
  void drop(size_t count);

  /// Closes the holes whose lowest vertex is one of [first, end): outlines of at most eight edges,
  /// not counting middles, inside which triangles face as the vertices do. So the rim of a small
  /// piece of mesh is none. @pre All triangles were added around the vertices that are at most four
  /// edges from these. @param normals One per vertex, of any length. @param add Takes the
  /// triangles.
  void closeHoles(size_t first, size_t end, const std::vector<Vec3f>& positions,
                  const std::vector<Vec3f>& normals,
                  const std::function<void(const Triangle&)>& add);

  /// Where a vertex goes. @pre All triangles around it and around the next two vertices each way
  /// were added. @param positions One per vertex, as they were before.
  Vec3f smoothed(size_t vertex, const std::vector<Vec3f>& positions) const;

  /// The vertices on outlines of a mesh that is here as a whole, and where they go.
  std::vector<std::pair<size_t, Vec3f>> smoothed(const std::vector<Vec3f>& positions) const;

 private:
  static constexpr int kForwards = 0, kBackwards = 1;  ///< Ways along an outline.
  static constexpr size_t kNone = SIZE_MAX;

  /// What the triangles around a vertex say of the vertices beside it: each triangle has one after
  /// the vertex and one before it, counter-clockwise. Of the numbers of those after it less those
  /// before it, and of their squares, only the two ends are left, if the triangles are one fan: so
  /// these follow, and both sums are 0 where the fan is closed. Numbers count from that of the
  /// vertex. Sums may wrap on their way: what they come to does not.
  struct Vertex {
    uint64_t squares;
    uint32_t sum;
    int32_t ends[2];  ///< Per way, once they are worked out; 0: the triangles are no fan.
    Kind kind;
    uint8_t triangles;  ///< How many are around it; 2: two or more.
    bool has_ends;
  };

  bool isInside(size_t vertex) const { return vertices_[vertex].sum == 0; }
  Kind kindOf(size_t vertex) const { return vertices_[vertex].kind; }
  void findEnds(size_t vertex) const;
  size_t endOfFan(size_t vertex, int way) const;
  size_t beside(size_t vertex, int way) const;
  size_t nextOnEdge(size_t vertex, int way) const;
  void followLoop(size_t lowest, std::vector<uint32_t>& loop) const;
  bool cutCorner(std::vector<uint32_t>& loop, const std::vector<Vec3f>& positions,
                 const std::vector<Vec3f>& normals, std::vector<Triangle>& triangles) const;
  Vec3f shiftOf(size_t vertex, const std::vector<Vec3f>& positions) const;

  mutable std::vector<Vertex> vertices_;  ///< Their ends are worked out when they are asked for.
};

}  // namespace dtsdf
