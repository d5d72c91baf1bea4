/// Takes vertices out of a mesh, one by one, as long as what is left stays near enough to them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "meshing/quadric.h"
#include "meshing/tolerances.h"
#include "meshing/triangle_fans.h"

namespace dtsdf {

/// A vertex and the neighbour that takes over its triangles.
struct Merge {
  uint32_t from, to;
};

/// Each vertex that has gone keeps a triangle that stands for it, and every later change has to
/// find one near enough again, out of those that take its place.
class Collapser {
 public:
  /// The mesh outlives it. `report` is called now and then with the share that is prepared.
  Collapser(const Mesh& mesh, double mean_edge_m, double max_error_m,
            const std::function<void(double share)>& report);

  /// Vertices that may go. Borders stay, and where more than two triangles meet: only a vertex goes
  /// whose triangles close to one fan.
  const std::vector<uint32_t>& removable() const { return removable_; }

  bool hasGone(uint32_t vertex) const { return fans_.hasGone(vertex); }

  /// Has merges tried again that failed.
  void forgetTries();

  /// With the neighbour that costs least, as it was when the triangles at the vertex changed last;
  /// with the vertex itself if that costs too much, or was tried already.
  Merge cheapest(uint32_t vertex, double error_m);

  /// False, and nothing changes, where something would be off by more than the error.
  bool tryMerge(const Merge& merge, double error_m);

  /// The mesh of the triangles that are left, with its vertices in their old order.
  Mesh remaining() const;

  /// The largest distance of a vertex that has gone from any triangle of what is left.
  double largestDistance_m(const Mesh& simple) const;

 private:
  static constexpr uint32_t kNone = TriangleFans::kNone;

  /// A vertex as one that has gone; the next one that the same triangle stands for.
  struct Point {
    Vec3f p, normal;
    uint32_t next;
    float off_m;  ///< From its triangle, when that was chosen.
  };
  struct State {
    double cost;
    uint32_t to;           ///< The cheapest neighbour,
    uint32_t known;        ///< of these changes.
    uint32_t changes = 0;  ///< Of the triangles at the vertex.
    uint32_t tried;        ///< At these.
  };
  /// A triangle at v as it would be.
  struct WingAfter {
    uint32_t triangle;
    Vec3f from, to, normal;
  };
  struct Move {
    uint32_t point, triangle;
    float off_m;
  };

  void sumQuadrics();
  void findCheapest(uint32_t vertex);
  bool keepsDirections(uint32_t v) const;
  bool rehost(uint32_t u, uint32_t v, double error_m);
  bool moveTo(uint32_t point, const Vec3f& v, double error_m);
  void commit(uint32_t u, uint32_t v);

  const Mesh& mesh_;
  const std::vector<Vec3f>& p_;
  TriangleFans fans_;  ///< Its notes: the first vertex that a triangle stands for.
  std::vector<uint32_t> removable_;
  std::vector<Point> points_;
  std::vector<State> states_;
  std::vector<Quadric> quadrics_;
  Tolerances tolerances_;
  std::vector<Wing> wings_;
  std::vector<WingAfter> wings_after_;
  std::vector<Move> moves_;
};

}  // namespace dtsdf
