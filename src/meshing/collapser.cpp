#include "meshing/collapser.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/core/vec.h"
#include "meshing/surface_distance.h"

namespace dtsdf {
namespace {

/// What each of two opposing sides may use of what is between them.
constexpr double kShareBetween = 0.45;

/// Errors up to so many mean edges are common enough to measure gaps for them beforehand.
constexpr double kNearEdges = 2.0;

constexpr size_t kReportEvery = 4096;

}  // namespace

Tolerances::Tolerances(const Mesh& mesh, const std::vector<uint32_t>& vertices,
                       const FacingLimits& opposing, double mean_edge_m, double max_error_m,
                       const std::function<void(double share)>& report)
    : mesh_(mesh),
      opposing_(opposing),
      near_m_(std::min(max_error_m, kNearEdges * mean_edge_m)),
      max_error_m_(max_error_m),
      tree_(mesh.vertices_m, mesh.triangles),
      tolerance_m_(mesh.vertices_m.size()) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    if (i % kReportEvery == 0)
      report(static_cast<double>(i) / static_cast<double>(vertices.size()));
    tolerance_m_[vertices[i]] = measure(vertices[i], near_m_);
  }
}

/// Negative where no gap is found within what errors up to `error_m` need.
float Tolerances::measure(uint32_t vertex, double error_m) {
  const double limit_m = 1.01 * error_m / kShareBetween;
  const double gap_m =
      tree_.distance(mesh_.vertices_m[vertex], limit_m, mesh_.normals[vertex], opposing_, hint_);
  const auto tolerance_m = static_cast<float>(kShareBetween * gap_m);
  return gap_m < limit_m || error_m >= max_error_m_ ? tolerance_m : -tolerance_m;
}

double Tolerances::measured(uint32_t vertex, double error_m) {
  tolerance_m_[vertex] = measure(vertex, max_error_m_);
  return std::min(error_m, static_cast<double>(tolerance_m_[vertex]));
}

TriangleFans::TriangleFans(const Mesh& mesh)
    : ends_(mesh.vertices_m.size()), mark_(mesh.vertices_m.size(), 0) {
  const Triangle none{kNone, kNone, kNone};
  faces_.reserve(mesh.triangles.size());
  for (const Triangle& corners : mesh.triangles) {
    const auto first = static_cast<uint32_t>(4 * faces_.size());
    faces_.push_back({corners, none, kNone});
    for (uint32_t at = 0; at < 3; ++at) {
      Ends& ends = ends_[corners[at]];
      (ends.head == kNone ? ends.head : next(ends.tail)) = first + at;
      ends.tail = first + at;
    }
  }
}

void TriangleFans::list(uint32_t vertex, std::vector<Wing>& wings) {
  wings.clear();
  Ends& ends = ends_[vertex];
  uint32_t before = kNone;
  for (uint32_t link = ends.head; link != kNone;) {
    const Face& face = faces_[link / 4];
    const uint32_t at = link % 4, after = face.next[at];
    if (face.corners[0] != kNone) {
      wings.push_back(
          {link / 4, face.corners[at == 2 ? 0 : at + 1], face.corners[at == 0 ? 2 : at - 1]});
      before = link;
    } else {
      (before == kNone ? ends.head : next(before)) = after;
      if (ends.tail == link) ends.tail = before;
    }
    link = after;
  }
}

bool TriangleFans::isClosed(const std::vector<Wing>& wings) {
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

bool TriangleFans::staysManifold(uint32_t u, const std::vector<Wing>& wings, uint32_t v) {
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

void TriangleFans::merge(uint32_t u, const std::vector<Wing>& wings, uint32_t v) {
  for (const Wing& wing : wings) {
    Triangle& corners = faces_[wing.triangle].corners;
    if (wing.from == v || wing.to == v) {
      corners = {kNone, kNone, kNone};
    } else {
      *std::find(corners.begin(), corners.end(), u) = v;
    }
  }
  Ends &from = ends_[u], &to = ends_[v];
  next(to.tail) = from.head;
  to.tail = from.tail;
  from = {};
}

namespace {

/// Normals that differ by more than this face each other: cosine of 105 degrees.
constexpr float kOpposite = -0.25f;

/// A triangle turns no further than this when a vertex goes: cosine of 70 degrees.
constexpr float kLeastTurn = 0.34f;

/// The height of a triangle is at least this share of its longest side.
constexpr float kLeastHeight = 0.01f;

std::vector<uint32_t> closedVertices(TriangleFans& fans, size_t vertices) {
  std::vector<uint32_t> closed;
  std::vector<Wing> wings;
  for (uint32_t v = 0; v < vertices; ++v) {
    fans.list(v, wings);
    if (fans.isClosed(wings)) closed.push_back(v);
  }
  return closed;
}

}  // namespace

Collapser::Collapser(const Mesh& mesh, double mean_edge_m, double max_error_m,
                     const std::function<void(double share)>& report)
    : mesh_(mesh),
      p_(mesh.vertices_m),
      fans_(mesh),
      removable_(closedVertices(fans_, p_.size())),
      states_(p_.size(), State{0.0, 0, kNone, 0, kNone}),
      quadrics_(p_.size()),
      tolerances_(mesh, removable_, FacingLimits{-1.01f, kOpposite}, mean_edge_m, max_error_m,
                  report) {
  points_.reserve(p_.size());
  for (size_t i = 0; i < p_.size(); ++i) points_.push_back({p_[i], mesh.normals[i], kNone, 0.0f});
  sumQuadrics();
}

void Collapser::sumQuadrics() {
  for (const auto& t : mesh_.triangles) {
    const Vec3f n = cross(p_[t[1]] - p_[t[0]], p_[t[2]] - p_[t[0]]);
    const float length = norm(n);
    if (length == 0.0f) continue;
    for (const uint32_t v : t) {
      quadrics_[v].add((1.0f / length) * n, p_[t[0]], static_cast<double>(length));
    }
  }
}

void Collapser::forgetTries() {
  for (State& state : states_) state.tried = kNone;
}

Merge Collapser::cheapest(uint32_t vertex, double error_m) {
  State& state = states_[vertex];
  if (state.tried == state.changes) return {vertex, vertex};  // nothing is new about it
  if (state.known != state.changes || hasGone(state.to)) findCheapest(vertex);
  return {vertex, state.cost > error_m * error_m ? vertex : state.to};
}

void Collapser::findCheapest(uint32_t vertex) {
  const Quadric& q = quadrics_[vertex];
  State& state = states_[vertex];
  state.known = state.changes;
  state.to = vertex;
  state.cost = std::numeric_limits<double>::infinity();
  fans_.list(vertex, wings_);
  for (const Wing& wing : wings_) {
    const uint32_t v = wing.from;  // each neighbour is that of one triangle
    const double weight = q.weight + quadrics_[v].weight;
    if (weight <= 0.0) continue;
    const double cost = std::max(0.0, (q.at(p_[v]) + quadrics_[v].at(p_[v])) / weight);
    if (cost < state.cost || (cost == state.cost && v < state.to)) {
      state.cost = cost;
      state.to = v;
    }
  }
}

bool Collapser::tryMerge(const Merge& merge, double error_m) {
  const auto [u, v] = merge;
  fans_.list(u, wings_);
  const bool is_neighbour = std::any_of(wings_.begin(), wings_.end(),
                                        [v = v](const Wing& wing) { return wing.from == v; });
  if (!is_neighbour) return false;  // it has gone meanwhile; another one is for the next pass
  states_[u].tried = states_[u].changes;
  if (!keepsDirections(v) || !fans_.staysManifold(u, wings_, v) || !rehost(u, v, error_m)) {
    return false;
  }
  commit(u, v);
  return true;
}

/// Whether no triangle that is left turns over, or loses its area.
bool Collapser::keepsDirections(uint32_t v) const {
  for (const Wing& wing : wings_) {
    if (wing.from == v || wing.to == v) continue;
    const auto& t = fans_.corners(wing.triangle);
    const Vec3f before = cross(p_[t[1]] - p_[t[0]], p_[t[2]] - p_[t[0]]);
    const Vec3f edge = p_[wing.to] - p_[wing.from];
    const Vec3f after = cross(edge, p_[v] - p_[wing.from]);
    const float length = norm(after), length_before = norm(before);
    const Vec3f a = p_[v] - p_[wing.from], b = p_[v] - p_[wing.to];
    const float longest = maximum(dot(edge, edge), maximum(dot(a, a), dot(b, b)));
    if (!(length > kLeastHeight * longest)) return false;
    if (length_before == 0.0f) continue;
    if (dot(before, after) < kLeastTurn * length * length_before) return false;
  }
  return true;
}

/// Finds a triangle for each vertex that has gone, among those that there would be; false if one
/// has none near enough.
bool Collapser::rehost(uint32_t u, uint32_t v, double error_m) {
  moves_.clear();
  wings_after_.clear();
  for (const Wing& wing : wings_) {
    if (wing.from == v || wing.to == v) continue;
    const Vec3f from = p_[wing.from], to = p_[wing.to];
    const Vec3f n = cross(to - from, p_[v] - from);
    wings_after_.push_back({wing.triangle, from, to, (1.0f / norm(n)) * n});
  }
  if (!moveTo(u, p_[v], error_m)) return false;
  for (const Wing& wing : wings_) {
    for (uint32_t i = fans_.note(wing.triangle); i != kNone; i = points_[i].next) {
      if (!moveTo(i, p_[v], error_m)) return false;
    }
  }
  return true;
}

bool Collapser::moveTo(uint32_t point, const Vec3f& v, double error_m) {
  const double limit_m = tolerances_.within(point, error_m);
  const Vec3f p = points_[point].p, normal = points_[point].normal;
  double nearest = limit_m * limit_m;
  Move move{point, kNone, 0.0f};
  for (const WingAfter& after : wings_after_) {
    const double height = static_cast<double>(dot(after.normal, p - v));
    if (height * height > nearest) continue;
    if (dot(after.normal, normal) < kOpposite) continue;
    const double distance = squaredDistanceOfTriangle(p, v, after.from, after.to);
    if (distance > nearest) continue;
    nearest = distance;
    move.triangle = after.triangle;
  }
  if (move.triangle == kNone) return false;
  move.off_m = static_cast<float>(std::sqrt(nearest));
  moves_.push_back(move);
  return true;
}

void Collapser::commit(uint32_t u, uint32_t v) {
  for (const Wing& wing : wings_) {
    fans_.note(wing.triangle) = kNone;
    ++states_[wing.from].changes;
  }
  for (const Move& move : moves_) {
    Point& point = points_[move.point];
    point.next = std::exchange(fans_.note(move.triangle), move.point);
    point.off_m = move.off_m;
  }
  fans_.merge(u, wings_, v);
  quadrics_[v].add(quadrics_[u]);
}

// What each vertex was off when it was looked at last is no less than what it is off, so that few
// need another look.
double Collapser::largestDistance_m(const Mesh& simple) const {
  std::vector<uint32_t> order;
  for (uint32_t v = 0; v < points_.size(); ++v) {
    if (points_[v].off_m > 0.0f) order.push_back(v);
  }
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const float of_a = points_[a].off_m, of_b = points_[b].off_m;
    return of_a != of_b ? of_a > of_b : a < b;
  });
  const SurfaceTree tree(simple.vertices_m, simple.triangles);
  double largest_m = 0.0;
  for (const uint32_t v : order) {
    const auto bound_m = static_cast<double>(points_[v].off_m);
    if (bound_m <= largest_m) break;
    largest_m = std::max(largest_m, tree.distance(p_[v], bound_m));
  }
  return largest_m;
}

Mesh Collapser::remaining() const {
  std::vector<uint32_t> number(p_.size(), kNone);
  const auto triangles = static_cast<uint32_t>(mesh_.triangles.size());
  for (uint32_t i = 0; i < triangles; ++i) {
    if (fans_.triangleHasGone(i)) continue;
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
    if (fans_.triangleHasGone(i)) continue;
    const auto& t = fans_.corners(i);
    result.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
  }
  return result;
}

}  // namespace dtsdf
