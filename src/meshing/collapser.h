/// Takes vertices out of a mesh, one by one, as long as what is left stays near enough to them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "dtsdf_mapping/geometry.h"
#include "dtsdf_mapping/mesh.h"
#include "meshing/surface_distance.h"

namespace dtsdf {

/// Squared distances from many planes, as one polynomial. The sum of squared distances from planes,
/// weighted.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, xd = 0, yy = 0, yz = 0, yd = 0, zz = 0, zd = 0, dd = 0, weight = 0;

  void add(const Vec3f& unit_normal, const Vec3f& point, double w) {
    const double x = unit_normal.x, y = unit_normal.y, z = unit_normal.z;
    const double d = -(x * point.x + y * point.y + z * point.z);
    xx += w * x * x, xy += w * x * y, xz += w * x * z, xd += w * x * d;
    yy += w * y * y, yz += w * y * z, yd += w * y * d;
    zz += w * z * z, zd += w * z * d, dd += w * d * d, weight += w;
  }

  void add(const Quadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, xd += q.xd, yy += q.yy, yz += q.yz, yd += q.yd;
    zz += q.zz, zd += q.zd, dd += q.dd, weight += q.weight;
  }

  double at(const Vec3f& p) const {
    const double x = p.x, y = p.y, z = p.z;
    return x * (xx * x + 2 * (xy * y + xz * z + xd)) + y * (yy * y + 2 * (yz * z + yd)) +
           z * (zz * z + 2 * zd) + dd;
  }
};

/// How far vertices may move before surfaces that face each other could meet. For some vertices of
/// a mesh, which outlives it, almost half of their distance from an opposing surface. Wide gaps are
/// measured only where a large error asks for them: most vertices never do.
class Tolerances {
 public:
  /// Errors are at most `max_error_m`; `report` is called now and then with the share that is done.
  Tolerances(const Mesh& mesh, const std::vector<uint32_t>& vertices, const FacingLimits& opposing,
             double mean_edge_m, double max_error_m,
             const std::function<void(double share)>& report);

  /// What one of the vertices may move within an error.
  double within(uint32_t vertex, double error_m) {
    const float tolerance_m = tolerance_m_[vertex];
    if (tolerance_m >= 0.0f)
      return error_m < tolerance_m ? error_m : static_cast<double>(tolerance_m);
    return error_m <= near_m_ ? error_m : measured(vertex, error_m);
  }

 private:
  float measure(uint32_t vertex, double error_m);
  double measured(uint32_t vertex, double error_m);

  const Mesh& mesh_;
  const FacingLimits opposing_;
  const double near_m_, max_error_m_;
  const SurfaceTree tree_;
  SurfaceTree::Hint hint_ = SurfaceTree::kNoHint;  ///< Neighbours have neighbouring numbers.
  std::vector<float> tolerance_m_;  ///< Negative: none found within what errors up to near_m_ need.
};

/// A triangle at a vertex: the two others, in its order.
struct Wing {
  uint32_t triangle, from, to;
};

/// Which triangles meet at each vertex of a mesh, while vertices merge into their neighbours.
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
