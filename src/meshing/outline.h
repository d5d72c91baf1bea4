/// Outlines: the boundary lines of a mesh.
///
/// A short outline surrounds a hole, left by units in which no direction speaks. It is closed.
///
/// A mesh ends with whole units, so a longer outline has teeth of a voxel where images disagree
/// about the last units. On average the line is right, so its vertices are smoothed along it with
/// the weights (-1 4 10 4 -1) / 16, which keep straight and evenly curved lines but remove teeth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// The outlines of a mesh whose vertices and triangles are added one by one. Vertices are numbered
/// from 0.
class Outline {
 public:
  using Triangle = std::array<uint32_t, 3>;

  enum class Kind : uint8_t {
    kPlain,
    kMiddle,  ///< The midpoint of a side of a refined mesh: it moves with the side's ends.
    kFixed,   ///< It stays in place, since some triangles around it are missing.
  };

  void reserve(size_t vertices) { vertices_.reserve(vertices); }
  void addVertex(Kind kind) { vertices_.push_back({0, 0, {0, 0}, kind, 0, false}); }
  void addTriangle(const Triangle& triangle);

  /// Forgets the first `count` vertices and reduces the numbers of the others by `count`.
  void drop(size_t count);

  /// Closes the holes whose lowest vertex is in [first, end). A hole is an outline of at most eight
  /// edges, not counting midpoints, that can be filled with triangles facing the same way as its
  /// vertices; the rim of a small piece of mesh is not a hole. @pre All triangles around vertices
  /// up to four edges from these were added.
  /// @param normals One per vertex, of any length.
  /// @param add Receives the new triangles.
  void closeHoles(size_t first, size_t end, const std::vector<Vec3f>& positions,
                  const std::vector<Vec3f>& normals,
                  const std::function<void(const Triangle&)>& add);

  /// The smoothed position of a vertex. @pre All triangles around it and around the next two
  /// vertices each way were added. @param positions One per vertex, before smoothing.
  Vec3f smoothed(size_t vertex, const std::vector<Vec3f>& positions) const;

  /// The vertices on outlines and their smoothed positions. @pre The whole mesh was added.
  std::vector<std::pair<size_t, Vec3f>> smoothed(const std::vector<Vec3f>& positions) const;

 private:
  static constexpr int kForwards = 0, kBackwards = 1;  ///< Ways along an outline.
  static constexpr size_t kNone = SIZE_MAX;

  /// A vertex, with sums over the triangles around it. Counter-clockwise, each triangle has one
  /// vertex before this one and one after it. If the triangles form one fan, the sum of the numbers
  /// after minus those before, and the same sum of their squares, depend only on the fan's two
  /// ends. The ends are computed from these sums, which are both 0 if the fan is closed. Numbers
  /// are relative to this vertex's. Sums may wrap on the way, but their final values fit.
  struct Vertex {
    uint64_t squares;
    uint32_t sum;
    int32_t ends[2];  ///< The fan's ends per way, once computed; 0: not a fan.
    Kind kind;
    uint8_t triangles;  ///< Triangles around the vertex; 2: two or more.
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

  mutable std::vector<Vertex> vertices_;  ///< Their ends are computed on first use.
};

}  // namespace dtsdf
