#include "dtsdf_mapping/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "kernels/core/vec.h"
#include "meshing/surface_distance.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// The weighted sum of squared distances from planes, as one polynomial.
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

/// Number of vertices between two progress reports.
constexpr size_t kReportEach = 4096;

/// Each of two surfaces facing each other may move by this fraction of the gap between them.
constexpr double kShareBetween = 0.45;

/// Most errors are below this many mean edge lengths. Gaps are first measured only as far as these
/// errors require.
constexpr double kNearEdges = 2.0;

/// Surfaces face each other if the cosine between their normals is below this (about 105 degrees).
constexpr float kOpposite = -0.25f;

/// How far each vertex may move before surfaces that face each other could meet: almost half its
/// distance from the nearest opposing surface. Distances are measured on first use, and only as far
/// as the error requires. The mesh must outlive this object.
class Tolerances {
 public:
  /// @param max_error_m The largest error that will be used.
  Tolerances(const Mesh& mesh, double mean_edge_m, double max_error_m)
      : mesh_(mesh),
        near_m_(std::min(max_error_m, kNearEdges * mean_edge_m)),
        max_error_m_(max_error_m),
        tree_(mesh.vertices_m, mesh.triangles),
        tolerance_m_(mesh.vertices_m.size(), kUnknown) {}

  /// How far a vertex may move, but at most `error_m`.
  double within(uint32_t vertex, double error_m) {
    float& tolerance_m = tolerance_m_[vertex];
    if (tolerance_m == kUnknown) tolerance_m = measure(vertex, near_m_);
    if (tolerance_m < 0.0f && error_m > near_m_) tolerance_m = measure(vertex, max_error_m_);
    return tolerance_m < 0.0f ? error_m : std::min(error_m, static_cast<double>(tolerance_m));
  }

 private:
  static constexpr float kUnknown = std::numeric_limits<float>::infinity();

  /// Measures the tolerance. It is negative if no gap is narrow enough to limit errors up to
  /// `error_m`, but larger errors may be used later.
  float measure(uint32_t vertex, double error_m) {
    const double limit_m = 1.01 * error_m / kShareBetween;
    const double gap_m =
        tree_.distance(mesh_.vertices_m[vertex], limit_m, mesh_.normals[vertex], kOpposite, hint_);
    const auto tolerance_m = static_cast<float>(kShareBetween * gap_m);
    return gap_m < limit_m || error_m >= max_error_m_ ? tolerance_m : -tolerance_m;
  }

  const Mesh& mesh_;
  const double near_m_, max_error_m_;
  const SurfaceTree tree_;
  SurfaceTree::Hint hint_ = SurfaceTree::kNoHint;  ///< From the previous vertex, often a neighbour.
  /// Tolerance of each vertex: infinite if not measured yet, negative if no gap is narrow enough to
  /// limit errors up to near_m_.
  std::vector<float> tolerance_m_;
};

/// A triangle at a vertex, with its other two vertices in the triangle's order.
struct Wing {
  uint32_t triangle, from, to;
};

/// The triangles at each vertex of a mesh, while vertices are merged into their neighbours.
class TriangleFans {
 public:
  using Triangle = std::array<uint32_t, 3>;

  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  static constexpr size_t kUsualTriangleCount = 8;  ///< Few vertices have more triangles.

  explicit TriangleFans(const Mesh& mesh)
      : triangles_(mesh.vertices_m.size()), mark_(mesh.vertices_m.size(), 0) {
    faces_.reserve(mesh.triangles.size());
    for (const Triangle& corners : mesh.triangles) {
      for (const uint32_t v : corners) {
        if (triangles_[v].empty()) triangles_[v].reserve(kUsualTriangleCount);
        triangles_[v].push_back(static_cast<uint32_t>(faces_.size()));
      }
      faces_.push_back({corners, kNone});
    }
  }

  /// Lists the triangles at a vertex, and forgets those that were removed.
  void list(uint32_t vertex, std::vector<Wing>& wings) {
    wings.clear();
    std::vector<uint32_t>& triangles = triangles_[vertex];
    const auto is_removed = [this](uint32_t triangle) { return isTriangleRemoved(triangle); };
    triangles.erase(std::remove_if(triangles.begin(), triangles.end(), is_removed),
                    triangles.end());
    for (const uint32_t triangle : triangles) {
      const Triangle& t = corners(triangle);
      const int at = t[0] == vertex ? 0 : (t[1] == vertex ? 1 : 2);
      wings.push_back({triangle, t[at == 2 ? 0 : at + 1], t[at == 0 ? 2 : at - 1]});
    }
  }

  /// Whether these triangles of one vertex form closed fans: each neighbour is in exactly two of
  /// the triangles.
  bool isClosed(const std::vector<Wing>& wings) {
    for (const Wing& wing : wings) mark_[wing.from] = mark_[wing.to] = 0;
    for (const Wing& wing : wings) {
      mark_[wing.from] += 1;
      mark_[wing.to] += 1u << 16;
    }
    const bool is_closed =
        wings.size() >= 3 && std::all_of(wings.begin(), wings.end(), [&](const Wing& wing) {
          return mark_[wing.from] == 0x10001u && mark_[wing.to] == 0x10001u;
        });
    for (const Wing& wing : wings) mark_[wing.from] = mark_[wing.to] = 0;
    return is_closed;
  }

  /// Whether the surface stays manifold if u, with these wings, merges into v: u and v must share
  /// exactly two triangles, and no neighbours outside them.
  bool keepsManifold(uint32_t u, const std::vector<Wing>& wings, uint32_t v) {
    list(v, wings_);
    ++stamp_;
    for (const Wing& wing : wings_) mark_[wing.from] = mark_[wing.to] = stamp_;
    int common = 0, between = 0;
    for (const Wing& wing : wings) {
      if (wing.from != v && mark_[wing.from] == stamp_) ++common;
      if (wing.from == v || wing.to == v) ++between;
    }
    mark_[u] = 0;
    return common == 2 && between == 2;
  }

  /// Removes the triangles that u and v share, and assigns u's other triangles to v.
  void merge(uint32_t u, const std::vector<Wing>& wings, uint32_t v) {
    for (const Wing& wing : wings) {
      Triangle& corners = faces_[wing.triangle].corners;
      if (wing.from == v || wing.to == v) {
        corners = {kNone, kNone, kNone};
      } else {
        *std::find(corners.begin(), corners.end(), u) = v;
      }
    }
    const std::vector<uint32_t> moved = std::move(triangles_[u]);
    triangles_[v].insert(triangles_[v].end(), moved.begin(), moved.end());
    triangles_[u].clear();
  }

  bool isRemoved(uint32_t vertex) const { return triangles_[vertex].empty(); }
  bool isTriangleRemoved(uint32_t triangle) const { return faces_[triangle].corners[0] == kNone; }
  const Triangle& corners(uint32_t triangle) const { return faces_[triangle].corners; }

  /// A value per triangle for the caller's own use, initially kNone.
  uint32_t& note(uint32_t triangle) { return faces_[triangle].note; }

 private:
  /// The data of a triangle, kept together because meshes are larger than caches.
  struct alignas(16) Face {
    Triangle corners;  ///< kNone once the triangle was removed.
    uint32_t note;
  };

  std::vector<Face> faces_;
  std::vector<std::vector<uint32_t>> triangles_;  ///< Triangles at each vertex.
  std::vector<uint32_t> mark_;
  uint32_t stamp_ = 0;
  std::vector<Wing> wings_;
};

/// Cosine of the largest angle by which a merge may turn a triangle (70 degrees).
constexpr float kMinTurnCosine = 0.34f;

/// Minimum height of a triangle, as a fraction of its longest side.
constexpr float kMinHeight = 0.01f;

/// Merges vertices into their neighbours. Each removed vertex is assigned to a triangle within the
/// allowed error. A later merge may change this triangle only if one of the new triangles is within
/// the allowed error of the vertex.
class Collapser {
 public:
  /// The mesh must outlive this object.
  Collapser(const Mesh& mesh, double mean_edge_m, double max_error_m)
      : mesh_(mesh),
        p_(mesh.vertices_m),
        fans_(mesh),
        states_(p_.size(), State{0.0, 0, kNone, 0, kNone}),
        quadrics_(p_.size()),
        tolerances_(mesh, mean_edge_m, max_error_m) {
    points_.reserve(p_.size());
    for (size_t i = 0; i < p_.size(); ++i) points_.push_back({p_[i], mesh.normals[i], kNone, 0.0f});
    sumQuadrics();
  }

  /// The vertices that may be removed: those whose triangles form closed fans. Vertices on
  /// borders, or where more than two triangles share an edge, stay.
  std::vector<uint32_t> removable() {
    std::vector<uint32_t> closed;
    for (uint32_t v = 0; v < p_.size(); ++v) {
      fans_.list(v, wings_);
      if (fans_.isClosed(wings_)) closed.push_back(v);
    }
    return closed;
  }

  bool isRemoved(uint32_t vertex) const { return fans_.isRemoved(vertex); }

  /// Allows failed merges to be tried again.
  void resetTries() {
    for (State& state : states_) state.tried = kNone;
  }

  /// The neighbour into which a vertex merges at the lowest cost; the vertex itself if the merge
  /// costs too much or has already failed. Costs are recomputed only if the triangles at the vertex
  /// have changed, or the cheapest neighbour was removed.
  uint32_t cheapest(uint32_t vertex, double error_m) {
    State& state = states_[vertex];
    if (state.tried == state.changes) return vertex;  // nothing has changed since
    if (state.known != state.changes || isRemoved(state.to)) findCheapest(vertex);
    return state.cost > error_m * error_m ? vertex : state.to;
  }

  /// Merges u into v. @return false if that would exceed the error or damage the surface.
  bool tryMerge(uint32_t u, uint32_t v, double error_m) {
    fans_.list(u, wings_);
    const bool is_neighbour =
        std::any_of(wings_.begin(), wings_.end(), [v](const Wing& wing) { return wing.from == v; });
    if (!is_neighbour) return false;  // v was removed; the next pass finds another neighbour
    states_[u].tried = states_[u].changes;
    if (!keepsOrientation(v) || !fans_.keepsManifold(u, wings_, v) ||
        !reassignVertices(u, v, error_m)) {
      return false;
    }
    commit(u, v);
    return true;
  }

  /// The mesh of the remaining triangles. Its vertices keep their order.
  Mesh remaining() const {
    std::vector<uint32_t> number(p_.size(), kNone);
    const auto triangles = static_cast<uint32_t>(mesh_.triangles.size());
    for (uint32_t i = 0; i < triangles; ++i) {
      if (fans_.isTriangleRemoved(i)) continue;
      for (const uint32_t v : fans_.corners(i)) number[v] = 0;
    }
    Mesh result;
    result.origin_m = mesh_.origin_m;
    for (size_t i = 0; i < number.size(); ++i) {
      if (number[i] == kNone) continue;
      number[i] = static_cast<uint32_t>(result.vertices_m.size());
      result.vertices_m.push_back(p_[i]);
      result.normals.push_back(mesh_.normals[i]);
      if (!mesh_.colours.empty()) result.colours.push_back(mesh_.colours[i]);
    }
    for (uint32_t i = 0; i < triangles; ++i) {
      if (fans_.isTriangleRemoved(i)) continue;
      const auto& t = fans_.corners(i);
      result.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    }
    return result;
  }

  /// The largest distance of a removed vertex from the simplified mesh. Point::off_m is an upper
  /// bound for each distance, so only a few have to be measured.
  double largestDistance_m(const Mesh& simple) const {
    const SurfaceTree tree(simple.vertices_m, simple.triangles);
    double largest_m = 0.0;
    for (const Point& point : points_) {
      const auto bound_m = static_cast<double>(point.off_m);
      if (bound_m > largest_m) largest_m = std::max(largest_m, tree.distance(point.p, bound_m));
    }
    return largest_m;
  }

 private:
  static constexpr uint32_t kNone = TriangleFans::kNone;

  /// A vertex of the original mesh. Once it is removed, `next` is the next vertex assigned to the
  /// same triangle.
  struct Point {
    Vec3f p, normal;
    uint32_t next;
    float off_m;  ///< Distance from its triangle; 0 until it is removed.
  };
  struct State {
    double cost;
    uint32_t to;           ///< The cheapest neighbour.
    uint32_t known;        ///< `changes` when `to` was found.
    uint32_t changes = 0;  ///< How often the triangles at the vertex have changed.
    uint32_t tried;        ///< `changes` at the last try.
  };
  /// A triangle at v as it would be after a merge.
  struct NewWing {
    uint32_t triangle;
    Vec3f from, to, normal;
  };

  void sumQuadrics() {
    for (const auto& t : mesh_.triangles) {
      const Vec3f n = cross(p_[t[1]] - p_[t[0]], p_[t[2]] - p_[t[0]]);
      const float length = norm(n);
      if (length == 0.0f) continue;
      for (const uint32_t v : t) {
        quadrics_[v].add((1.0f / length) * n, p_[t[0]], static_cast<double>(length));
      }
    }
  }

  void findCheapest(uint32_t vertex) {
    const Quadric& q = quadrics_[vertex];
    State& state = states_[vertex];
    state.known = state.changes;
    state.to = vertex;
    state.cost = std::numeric_limits<double>::infinity();
    fans_.list(vertex, wings_);
    for (const Wing& wing : wings_) {
      const uint32_t v = wing.from;  // each neighbour is `from` in exactly one wing
      const double weight = q.weight + quadrics_[v].weight;
      if (weight <= 0.0) continue;
      const double cost = std::max(0.0, (q.at(p_[v]) + quadrics_[v].at(p_[v])) / weight);
      if (cost < state.cost || (cost == state.cost && v < state.to)) {
        state.cost = cost;
        state.to = v;
      }
    }
  }

  /// Whether no triangle that a merge keeps would turn too far or become too thin.
  bool keepsOrientation(uint32_t v) const {
    for (const Wing& wing : wings_) {
      if (wing.from == v || wing.to == v) continue;
      const auto& t = fans_.corners(wing.triangle);
      const Vec3f before = cross(p_[t[1]] - p_[t[0]], p_[t[2]] - p_[t[0]]);
      const Vec3f edge = p_[wing.to] - p_[wing.from];
      const Vec3f after = cross(edge, p_[v] - p_[wing.from]);
      const float length = norm(after), length_before = norm(before);
      const Vec3f a = p_[v] - p_[wing.from], b = p_[v] - p_[wing.to];
      const float longest = maximum(dot(edge, edge), maximum(dot(a, a), dot(b, b)));
      if (!(length > kMinHeight * longest)) return false;
      if (length_before == 0.0f) continue;
      if (dot(before, after) < kMinTurnCosine * length * length_before) return false;
    }
    return true;
  }

  /// Assigns u, and the removed vertices assigned to its triangles, to the triangles that the merge
  /// would leave. @return false if no triangle is close enough to one of these vertices.
  bool reassignVertices(uint32_t u, uint32_t v, double error_m) {
    moves_.clear();
    new_wings_.clear();
    for (const Wing& wing : wings_) {
      if (wing.from == v || wing.to == v) continue;
      const Vec3f from = p_[wing.from], to = p_[wing.to];
      const Vec3f n = cross(to - from, p_[v] - from);
      new_wings_.push_back({wing.triangle, from, to, (1.0f / norm(n)) * n});
    }
    if (!moveTo(u, p_[v], error_m)) return false;
    for (const Wing& wing : wings_) {
      for (uint32_t i = fans_.note(wing.triangle); i != kNone; i = points_[i].next) {
        if (!moveTo(i, p_[v], error_m)) return false;
      }
    }
    return true;
  }

  bool moveTo(uint32_t point, const Vec3f& v, double error_m) {
    const double limit_m = tolerances_.within(point, error_m);
    const Vec3f p = points_[point].p, normal = points_[point].normal;
    double nearest = limit_m * limit_m;
    uint32_t triangle = kNone;
    for (const NewWing& after : new_wings_) {
      const double height = static_cast<double>(dot(after.normal, p - v));
      if (height * height > nearest) continue;
      if (dot(after.normal, normal) < kOpposite) continue;
      const double distance = squaredDistanceOfTriangle(p, v, after.from, after.to);
      if (distance > nearest) continue;
      nearest = distance;
      triangle = after.triangle;
    }
    if (triangle == kNone) return false;
    moves_.emplace_back(point, triangle, static_cast<float>(std::sqrt(nearest)));
    return true;
  }

  void commit(uint32_t u, uint32_t v) {
    for (const Wing& wing : wings_) {
      fans_.note(wing.triangle) = kNone;
      ++states_[wing.from].changes;
    }
    for (const auto& [gone, triangle, off_m] : moves_) {
      points_[gone].next = std::exchange(fans_.note(triangle), gone);
      points_[gone].off_m = off_m;
    }
    fans_.merge(u, wings_, v);
    quadrics_[v].add(quadrics_[u]);
  }

  const Mesh& mesh_;
  const std::vector<Vec3f>& p_;
  TriangleFans fans_;  ///< Each triangle's note is the first vertex assigned to it.
  std::vector<Point> points_;
  std::vector<State> states_;
  std::vector<Quadric> quadrics_;
  Tolerances tolerances_;
  std::vector<Wing> wings_;
  std::vector<NewWing> new_wings_;
  /// Removed vertices, their new triangles, and their distances from these.
  std::vector<std::tuple<uint32_t, uint32_t, float>> moves_;
};

/// The errors used in each decade. A mesh is simplified with increasing errors, up to the requested
/// one. The simplification with each error starts from the result of the previous error.
constexpr double kStepsOfDecade[] = {1.0, 1.5, 2.0, 3.0, 5.0, 7.0};

/// Errors below this fraction of the mean edge length allow hardly any vertices to be removed.
constexpr double kFirstShareOfEdge = 0.06;

/// Maximum number of passes per error, and the fraction of vertices that a pass must remove for
/// another pass to follow.
constexpr int kPasses = 6;
constexpr double kMinGain = 0.1;

/// If an error allows no more than this fraction of the vertices to be removed, larger errors are
/// not tried.
constexpr double kEndGain = 1e-3;

/// Errors are limited to this many mean edge lengths.
constexpr double kMaxEdges = 24.0;

/// Errors below this many mean edge lengths may be too small for any vertex to be removed, so
/// kEndGain does not apply to them.
constexpr double kSmallShareOfEdge = 3.0;

double meanEdge_m(const Mesh& mesh) {
  double sum_m = 0.0;
  for (const auto& t : mesh.triangles) {
    sum_m += norm(mesh.vertices_m[t[1]] - mesh.vertices_m[t[0]]);
  }
  return sum_m / static_cast<double>(mesh.triangles.size());
}

/// The errors to simplify with, in order. Unless the requested error is tiny, it affects only the
/// end of the list.
std::vector<double> errorsUpTo(double max_error_m, double mean_edge_m) {
  const double first_m = std::min(kFirstShareOfEdge * mean_edge_m, max_error_m);
  std::vector<double> errors;
  double last_m = 0.0;
  const int begin = static_cast<int>(std::floor(std::log10(std::max(first_m, 1e-12))));
  for (int decade = begin;; ++decade) {
    for (const double step : kStepsOfDecade) {
      const double error_m = step * std::pow(10.0, decade);
      if (error_m > max_error_m * (1.0 + 1e-9)) {
        if (errors.empty()) errors.push_back(last_m > 0.0 ? last_m : max_error_m);
        return errors;
      }
      last_m = error_m;
      if (error_m >= first_m) errors.push_back(error_m);
    }
  }
}

/// Merges vertices with errors of up to `error_m`. Each pass chooses all merges before it does the
/// first one; otherwise flat areas would become slivers. Merges are done in vertex order, since
/// neighbours are close in memory.
/// @param live Vertices that may still be removed.
template <class Report>
void simplifyWithin(double error_m, Collapser& collapser, std::vector<uint32_t>& live,
                    const Report& report) {
  collapser.resetTries();
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<uint32_t> into(live.size());
    for (size_t i = 0; i < live.size(); ++i) {
      if (i % kReportEach == 0) report();
      into[i] = collapser.cheapest(live[i], error_m);
    }
    size_t done = 0;
    for (size_t i = 0; i < live.size(); ++i) {
      if (i % kReportEach == 0) report();
      done += into[i] != live[i] && collapser.tryMerge(live[i], into[i], error_m) ? 1 : 0;
    }
    const auto is_removed = [&](uint32_t v) { return collapser.isRemoved(v); };
    live.erase(std::remove_if(live.begin(), live.end(), is_removed), live.end());
    if (static_cast<double>(done) < kMinGain * static_cast<double>(live.size())) break;
  }
}

double diagonalOf(const Mesh& mesh) {
  Vec3f low = mesh.vertices_m.front(), high = low;
  for (const Vec3f& p : mesh.vertices_m) {
    low = minOf(low, p);
    high = maxOf(high, p);
  }
  return static_cast<double>(norm(high - low));
}

}  // namespace

SimplifiedMesh simplifyMesh(const Mesh& mesh, double max_error_m,
                            const SimplifyProgress& progress) {
  if (!(max_error_m >= 0.0) || !std::isfinite(max_error_m)) {
    throw std::invalid_argument(
        "the error of a simplified mesh must be 0 or a positive number of metres");
  }
  if (max_error_m == 0.0 || mesh.triangles.empty()) return {mesh, 0.0};
  const double diagonal_m = diagonalOf(mesh);
  if (max_error_m > diagonal_m) {
    throw std::invalid_argument("an error of " + shortestText(max_error_m) +
                                " m is larger than the whole mesh, which is " +
                                shortestText(diagonal_m) + " m across; use a smaller one");
  }
  const double mean_edge_m = meanEdge_m(mesh);
  max_error_m = std::min(max_error_m, kMaxEdges * mean_edge_m);
  const auto report = [&](double share) {
    if (progress) progress(share);
  };
  Collapser collapser(mesh, mean_edge_m, max_error_m);
  std::vector<uint32_t> live = collapser.removable();  // vertices that may still be removed
  const std::vector<double> errors = errorsUpTo(max_error_m, mean_edge_m);
  for (size_t i = 0; i < errors.size(); ++i) {
    const double progress = static_cast<double>(i) / static_cast<double>(errors.size());
    const size_t before = live.size();
    simplifyWithin(errors[i], collapser, live, [&] { report(progress); });
    const bool is_small = errors[i] < kSmallShareOfEdge * mean_edge_m;
    const auto gone = static_cast<double>(before - live.size());
    if (!is_small && gone <= kEndGain * static_cast<double>(before)) break;
  }
  SimplifiedMesh result;
  result.mesh = collapser.remaining();
  result.error_m = collapser.largestDistance_m(result.mesh);
  report(1.0);
  return result;
}

}  // namespace dtsdf
