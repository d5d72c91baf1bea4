/// Which triangles meet at each vertex of a mesh, while vertices merge into their neighbours.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// A triangle at a vertex: the two others, in its order.
struct Wing {
  uint32_t triangle, from, to;
};

class TriangleFans {
 public:
  using Triangle = std::array<uint32_t, 3>;

  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  explicit TriangleFans(const Mesh& mesh);

  /// The triangles at a vertex; those that have gone are unlinked on the way.
  void list(uint32_t vertex, std::vector<Wing>& wings);

  /// Whether these triangles of one vertex close to a single fan.
  bool isClosed(const std::vector<Wing>& wings);

  /// Whether u, with these wings, and v have no neighbours in common but those of the two triangles
  /// between them, so that the surface stays one when u merges into v.
  bool staysManifold(uint32_t u, const std::vector<Wing>& wings, uint32_t v);

  /// Gives v the triangles of u but those between the two, which go.
  void merge(uint32_t u, const std::vector<Wing>& wings, uint32_t v);

  bool hasGone(uint32_t vertex) const { return ends_[vertex].head == kNone; }
  bool triangleHasGone(uint32_t triangle) const { return faces_[triangle].corners[0] == kNone; }
  const Triangle& corners(uint32_t triangle) const { return faces_[triangle].corners; }

  /// For whoever uses the fans: a number for each triangle, kNone at first.
  uint32_t& note(uint32_t triangle) { return faces_[triangle].note; }

 private:
  /// What is looked up together lies together: meshes are larger than caches.
  struct alignas(32) Face {
    Triangle corners;  ///< Of a triangle that has gone: kNone.
    Triangle next;     ///< The next link at each of them.
    uint32_t note;
  };
  /// Of a list of links, which are 4 * triangle + corner.
  struct Ends {
    uint32_t head = kNone, tail = kNone;
  };

  uint32_t& next(uint32_t link) { return faces_[link / 4].next[link % 4]; }

  std::vector<Face> faces_;
  std::vector<Ends> ends_;  ///< Of each vertex.
  std::vector<uint32_t> mark_;
  uint32_t stamp_ = 0;
  std::vector<Wing> wings_;
};

}  // namespace dtsdf
