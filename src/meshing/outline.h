/// Outlines: the lines along which a mesh ends.
///
/// A mesh ends with a whole unit, so where images disagree about the last ones its outline is a saw
/// with teeth of a voxel. What they measured of it is right on average, so its vertices go to a
/// mean along it, by the weights (-1 4 10 4 -1) / 16: straight and evenly bent lines stay, teeth
/// go.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// Follows the outlines of a mesh whose vertices and triangles come one after the other. Vertices
/// are numbered from 0.
class Outline {
 public:
  enum class Kind : uint8_t {
    kPlain,
    kMiddle,  ///< The midpoint of a side of a refined mesh: it goes along with the side's ends.
    kFixed,   ///< It stays, as not all triangles around it are here.
  };

  void reserve(size_t vertices);
  void addVertex(Kind kind) {
    sums_.push_back(0);
    squares_.push_back(0);
    kinds_.push_back(kind);
  }
  void addTriangle(const std::array<uint32_t, 3>& triangle);

  /// Forgets the first vertices; the numbers of the others are less by so many.
  void drop(size_t count);

  /// Where a vertex goes. @pre All triangles around it and around the next two vertices each way
  /// were added. @param positions Of all vertices, as they were before.
  Vec3f smoothed(size_t vertex, const std::vector<Vec3f>& positions) const;

  /// The vertices on outlines of a mesh that is here as a whole, and where they go.
  std::vector<std::pair<size_t, Vec3f>> smoothed(const std::vector<Vec3f>& positions) const;

 private:
  enum Way { kForwards, kBackwards };
  static constexpr size_t kNone = SIZE_MAX;

  bool isInside(size_t vertex) const { return sums_[vertex] == 0; }
  size_t endOfFan(size_t vertex, Way way) const;
  size_t beside(size_t vertex, Way way) const;
  size_t nextOnEdge(size_t vertex, Way way) const;
  Vec3f shiftOf(size_t vertex, const std::vector<Vec3f>& positions) const;

  /// What the triangles around each vertex say of the vertices beside it: each triangle has one
  /// after the vertex and one before it, counter-clockwise. Of the numbers of those after it less
  /// those before it, and of their squares, only the two ends are left, if the triangles are one
  /// fan: so these follow, and both sums are 0 where the fan is closed. Numbers count from that of
  /// the vertex. Sums may wrap on their way: what they come to does not.
  std::vector<uint32_t> sums_;
  std::vector<uint64_t> squares_;
  std::vector<Kind> kinds_;
};

}  // namespace dtsdf
