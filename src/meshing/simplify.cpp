#include "dtsdf_mapping/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "kernels/core/vec.h"
#include "meshing/quadric.h"
#include "meshing/surface_distance.h"
#include "meshing/tolerances.h"

namespace dtsdf {
namespace {

using Triangle = std::array<uint32_t, 3>;

/// Normals that differ by more than this face each other: cosine of 105 degrees.
constexpr float kOpposite = -0.25f;

/// Errors in each decade: a mesh is simplified within one after the other, up to the one that is
/// asked for. So whoever asks for more gets what all before have left, and less of it.
constexpr double kStepsOfDecade[] = {1.0, 1.5, 2.0, 3.0, 5.0, 7.0};

/// Below this share of the mean edge hardly a vertex goes.
constexpr double kFirstShareOfEdge = 0.06;

/// Times that what is left is looked at within one error, and the share that has to go each time.
constexpr int kPasses = 6;
constexpr double kLeastGain = 0.1;

/// Where no more than this share of the vertices goes within one error, none does within the next.
constexpr double kEndGain = 1e-3;

/// A triangle turns no further than this when a vertex goes: cosine of 70 degrees.
constexpr float kLeastTurn = 0.34f;

/// An error of more mean edges than this counts as one of so many: no triangle is so large.
constexpr double kMostEdges = 24.0;

/// Below this share of it errors may be too small for what there is.
constexpr double kSmallShareOfEdge = 3.0;

/// The height of a triangle is at least this share of its longest side.
constexpr float kLeastHeight = 0.01f;

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

/// A triangle at a vertex: the two others, in its order.
struct Wing {
  uint32_t triangle, from, to;
};

/// Takes vertices out of a mesh one by one, each onto a neighbour, as long as every vertex that has
/// gone stays near enough to the triangles that took its place.
class Collapser {
 public:
  Collapser(const Mesh& mesh, double max_error_m, const SimplifyProgress& go_on)
      : mesh_(mesh),
        p_(mesh.vertices_m),
        mean_edge_m_(meanEdge_m()),
        max_error_m_(std::min(max_error_m, kMostEdges * mean_edge_m_)),
        go_on_(go_on),
        triangles_(mesh.triangles),
        is_dead_(triangles_.size(), 0),
        head_(p_.size(), kNone),
        tail_(p_.size(), kNone),
        next_(3 * triangles_.size(), kNone),
        hosted_(triangles_.size(), kNone),
        next_hosted_(p_.size(), kNone),
        off_m_(p_.size(), 0.0f),
        changes_(p_.size(), 0),
        tried_(p_.size(), kNone),
        known_(p_.size()),
        mark_(p_.size(), 0) {
    for (uint32_t corner = 0; corner < next_.size(); ++corner) link(corner);
    report(0.0);
    findRemovable();
    tolerances_.emplace(mesh_, live_, FacingLimits{-1.01f, kOpposite}, mean_edge_m_, max_error_m_,
                        [this](double share) { report(kSharePrepared * share); });
    sumQuadrics();
  }

  SimplifiedMesh run() {
    const std::vector<double> errors = errorsUpTo(max_error_m_);
    for (size_t i = 0; i < errors.size(); ++i) {
      const double begin = kSharePrepared + (1.0 - kSharePrepared) * i / errors.size();
      if (!simplifyWithin(errors[i], begin)) break;
    }
    tolerances_.reset();
    SimplifiedMesh result;
    result.mesh = select();
    result.error_m = measure(result.mesh);
    report(1.0);
    return result;
  }

 private:
  static constexpr double kSharePrepared = 0.3;  ///< Of the time, as far as progress is concerned.

  void report(double share) const {
    if (go_on_ && !go_on_(share)) throw SimplifyCancelled();
  }

  Vec3f crossOf(const Triangle& t) const {
    return cross(p_[t[1]] - p_[t[0]], p_[t[2]] - p_[t[0]]);
  }

  void link(uint32_t corner) {
    const uint32_t v = triangles_[corner / 3][corner % 3];
    if (head_[v] == kNone) {
      head_[v] = corner;
    } else {
      next_[tail_[v]] = corner;
    }
    tail_[v] = corner;
  }

  /// The triangles at a vertex; those that have gone are unlinked on the way.
  void listWings(uint32_t v, std::vector<Wing>& wings) {
    wings.clear();
    uint32_t before = kNone;
    for (uint32_t corner = head_[v]; corner != kNone; corner = next_[corner]) {
      const uint32_t triangle = corner / 3, at = corner % 3;
      if (is_dead_[triangle] == 0) {
        const Triangle& t = triangles_[triangle];
        wings.push_back({triangle, t[(at + 1) % 3], t[(at + 2) % 3]});
        before = corner;
        continue;
      }
      (before == kNone ? head_[v] : next_[before]) = next_[corner];
      if (tail_[v] == corner) tail_[v] = before;
    }
  }

  /// Borders stay, and where more than two triangles meet: only a vertex goes whose triangles close
  /// to one fan.
  void findRemovable() {
    is_removable_.assign(p_.size(), 0);
    for (uint32_t v = 0; v < p_.size(); ++v) {
      listWings(v, wings_);
      for (const Wing& wing : wings_) mark_[wing.from] = mark_[wing.to] = 0;
      for (const Wing& wing : wings_) {
        mark_[wing.from] += 1;
        mark_[wing.to] += 1u << 16;
      }
      const bool is_closed =
          wings_.size() >= 3 && std::all_of(wings_.begin(), wings_.end(), [&](const Wing& wing) {
            return mark_[wing.from] == 0x10001u && mark_[wing.to] == 0x10001u;
          });
      is_removable_[v] = is_closed ? 1 : 0;
      if (is_closed) live_.push_back(v);
    }
    std::fill(mark_.begin(), mark_.end(), 0);
  }

  void sumQuadrics() {
    quadrics_.resize(p_.size());
    for (const Triangle& t : triangles_) {
      const Vec3f n = crossOf(t);
      const float length = norm(n);
      if (length == 0.0f) continue;
      for (const uint32_t v : t) {
        quadrics_[v].add((1.0f / length) * n, p_[t[0]], static_cast<double>(length));
      }
    }
  }

  double meanEdge_m() const {
    double sum_m = 0.0;
    for (const Triangle& t : mesh_.triangles) sum_m += norm(p_[t[1]] - p_[t[0]]);
    return sum_m / static_cast<double>(mesh_.triangles.size());
  }

  /// The errors to go through, which do not depend on the one that is asked for but for their end.
  std::vector<double> errorsUpTo(double max_error_m) const {
    const double first_m = std::min(kFirstShareOfEdge * mean_edge_m_, max_error_m);
    std::vector<double> errors;
    double last_m = 0.0;
    const int begin = static_cast<int>(std::floor(std::log10(std::max(first_m, 1e-12))));
    for (int decade = begin; errors.size() < kMostErrors; ++decade) {
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
    return errors;
  }

  struct Collapse {
    double cost;
    uint32_t from, to;

    bool operator<(const Collapse& other) const {
      return cost != other.cost ? cost < other.cost : from < other.from;
    }
  };

  /// False once there is nothing more to gain.
  bool simplifyWithin(double error_m, double progress) {
    const size_t before = live_.size();
    std::fill(tried_.begin(), tried_.end(), kNone);
    for (int pass = 0; pass < kPasses; ++pass) {
      const std::vector<Collapse> collapses = listCollapses(error_m, progress);
      size_t done = 0;
      for (size_t i = 0; i < collapses.size(); ++i) {
        if (i % kReportEvery == 0) report(progress);
        done += tryCollapse(collapses[i], error_m) ? 1 : 0;
      }
      live_.erase(std::remove_if(live_.begin(), live_.end(),
                                 [&](uint32_t v) { return is_removable_[v] == 0; }),
                  live_.end());
      if (static_cast<double>(done) < kLeastGain * static_cast<double>(live_.size())) break;
    }
    const bool is_small = error_m < kSmallShareOfEdge * mean_edge_m_;
    return is_small ||
           static_cast<double>(before - live_.size()) > kEndGain * static_cast<double>(before);
  }

  /// For each vertex the neighbour onto which it goes at the least cost, the cheapest first.
  std::vector<Collapse> listCollapses(double error_m, double progress) {
    std::vector<Collapse> collapses;
    for (size_t i = 0; i < live_.size(); ++i) {
      if (i % kReportEvery == 0) report(progress);
      const uint32_t u = live_[i];
      if (tried_[u] == changes_[u]) continue;  // nothing is new about it
      const Collapse best = cheapestKnown(u);
      if (best.to != kNone && best.cost <= error_m * error_m) collapses.push_back(best);
    }
    std::sort(collapses.begin(), collapses.end());
    return collapses;
  }

  /// As it was when the triangles at the vertex changed last.
  Collapse cheapestKnown(uint32_t u) {
    Known& known = known_[u];
    if (known.changes != changes_[u] || hasGone(known.to)) {
      const Collapse best = cheapest(u);
      known = {changes_[u], best.to, best.cost};
    }
    return {known.cost, u, known.to};
  }

  bool hasGone(uint32_t v) const { return v != kNone && head_[v] == kNone; }

  Collapse cheapest(uint32_t u) {
    listWings(u, wings_);
    Collapse best{std::numeric_limits<double>::infinity(), u, kNone};
    const Quadric& q = quadrics_[u];
    for (const Wing& wing : wings_) {
      const uint32_t v = wing.from;  // each neighbour is that of one triangle
      const double weight = q.weight + quadrics_[v].weight;
      if (weight <= 0.0) continue;
      const double cost = std::max(0.0, (q.at(p_[v]) + quadrics_[v].at(p_[v])) / weight);
      if (cost < best.cost || (cost == best.cost && v < best.to)) best = {cost, u, v};
    }
    return best;
  }

  bool tryCollapse(const Collapse& collapse, double error_m) {
    const uint32_t u = collapse.from, v = collapse.to;
    listWings(u, wings_);
    const bool is_neighbour = std::any_of(wings_.begin(), wings_.end(),
                                          [&](const Wing& wing) { return wing.from == v; });
    if (!is_neighbour) return false;  // it has gone meanwhile; another one is for the next pass
    tried_[u] = changes_[u];
    if (!isManifoldAfter(u, v) || !keepsDirections(v) || !rehost(u, v, error_m)) return false;
    commit(u, v);
    return true;
  }

  /// Whether u and v have no neighbours in common but those of the two triangles between them.
  bool isManifoldAfter(uint32_t u, uint32_t v) {
    listWings(v, wings_of_other_);
    ++stamp_;
    for (const Wing& wing : wings_of_other_) mark_[wing.from] = mark_[wing.to] = stamp_;
    int common = 0, between = 0;
    for (const Wing& wing : wings_) {
      if (wing.from != v && mark_[wing.from] == stamp_) ++common;
      if (wing.from == v || wing.to == v) ++between;
    }
    mark_[u] = 0;
    return common == 2 && between == 2;
  }

  /// Whether no triangle that is left turns over, or loses its area.
  bool keepsDirections(uint32_t v) const {
    for (const Wing& wing : wings_) {
      if (wing.from == v || wing.to == v) continue;
      const Vec3f before = crossOf(triangles_[wing.triangle]);
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
  bool rehost(uint32_t u, uint32_t v, double error_m) {
    moves_.clear();
    wings_after_.clear();
    for (const Wing& wing : wings_) {
      if (wing.from == v || wing.to == v) continue;
      const Vec3f n = cross(p_[wing.to] - p_[wing.from], p_[v] - p_[wing.from]);
      wings_after_.push_back({wing, (1.0f / norm(n)) * n});
    }
    if (!moveTo(u, v, error_m)) return false;
    for (const Wing& wing : wings_) {
      for (uint32_t point = hosted_[wing.triangle]; point != kNone; point = next_hosted_[point]) {
        if (!moveTo(point, v, error_m)) return false;
      }
    }
    return true;
  }

  bool moveTo(uint32_t point, uint32_t v, double error_m) {
    const double limit_m = tolerances_->within(point, error_m);
    double nearest = limit_m * limit_m;
    Move move{point, kNone, 0.0f};
    for (const WingAfter& after : wings_after_) {
      if (dot(after.normal, mesh_.normals[point]) < kOpposite) continue;
      const Wing& wing = after.wing;
      const double height = static_cast<double>(dot(after.normal, p_[point] - p_[v]));
      if (height * height > nearest) continue;
      const double distance =
          squaredDistanceOfTriangle(p_[point], p_[v], p_[wing.from], p_[wing.to]);
      if (distance > nearest) continue;
      nearest = distance;
      move.triangle = wing.triangle;
    }
    if (move.triangle == kNone) return false;
    move.off_m = static_cast<float>(std::sqrt(nearest));
    moves_.push_back(move);
    return true;
  }

  void commit(uint32_t u, uint32_t v) {
    for (const Wing& wing : wings_) {
      hosted_[wing.triangle] = kNone;
      ++changes_[wing.from];
      Triangle& t = triangles_[wing.triangle];
      if (wing.from == v || wing.to == v) {
        is_dead_[wing.triangle] = 1;
      } else {
        *std::find(t.begin(), t.end(), u) = v;
      }
    }
    for (const Move& move : moves_) {
      next_hosted_[move.point] = std::exchange(hosted_[move.triangle], move.point);
      off_m_[move.point] = move.off_m;
    }
    next_[tail_[v]] = head_[u];
    tail_[v] = tail_[u];
    head_[u] = tail_[u] = kNone;
    quadrics_[v].add(quadrics_[u]);
    is_removable_[u] = 0;
  }

  /// Against the whole mesh. What each vertex was off when it was looked at last is no less than
  /// what it is off, so that few need another look.
  double measure(const Mesh& simple) const {
    std::vector<uint32_t> order;
    for (uint32_t v = 0; v < off_m_.size(); ++v) {
      if (off_m_[v] > 0.0f) order.push_back(v);
    }
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      return off_m_[a] != off_m_[b] ? off_m_[a] > off_m_[b] : a < b;
    });
    const SurfaceTree tree(simple.vertices_m, simple.triangles);
    double largest_m = 0.0;
    for (const uint32_t v : order) {
      const auto bound_m = static_cast<double>(off_m_[v]);
      if (bound_m <= largest_m) break;
      largest_m = std::max(largest_m, tree.distance(p_[v], bound_m));
    }
    return largest_m;
  }

  /// The mesh of the triangles that are left, with its vertices in their old order.
  Mesh select() const {
    std::vector<uint32_t> number(p_.size(), kNone);
    for (size_t i = 0; i < triangles_.size(); ++i) {
      if (is_dead_[i] != 0) continue;
      for (const uint32_t v : triangles_[i]) number[v] = 0;
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
    for (size_t i = 0; i < triangles_.size(); ++i) {
      const Triangle& t = triangles_[i];
      if (is_dead_[i] == 0) result.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    }
    return result;
  }

  static constexpr size_t kReportEvery = 4096;
  static constexpr size_t kMostErrors = 200;

  struct Known {
    uint32_t changes = kNone, to = kNone;
    double cost = 0.0;
  };
  struct WingAfter {
    Wing wing;
    Vec3f normal;
  };
  struct Move {
    uint32_t point, triangle;
    float off_m;
  };

  const Mesh& mesh_;
  const std::vector<Vec3f>& p_;
  const double mean_edge_m_;
  const double max_error_m_;
  const SimplifyProgress& go_on_;

  std::vector<Triangle> triangles_;
  std::vector<uint8_t> is_dead_;
  std::vector<uint32_t> head_, tail_, next_;  ///< Corners of each vertex: 3 * triangle + place.
  std::vector<uint32_t> hosted_, next_hosted_;  ///< Of each triangle, the vertices it stands for.
  std::vector<float> off_m_;        ///< Of each vertex that has gone: from its triangle.
  std::optional<Tolerances> tolerances_;
  std::vector<uint8_t> is_removable_;
  std::vector<uint32_t> live_;              ///< Those that are.
  std::vector<uint32_t> changes_, tried_;   ///< Of the triangles at a vertex; when it was tried.
  std::vector<Known> known_;
  std::vector<uint32_t> mark_;
  uint32_t stamp_ = 0;
  std::vector<Quadric> quadrics_;
  std::vector<Wing> wings_, wings_of_other_;
  std::vector<WingAfter> wings_after_;
  std::vector<Move> moves_;
};

double diagonalOf(const Mesh& mesh) {
  Vec3f low = mesh.vertices_m.front(), high = low;
  for (const Vec3f& p : mesh.vertices_m) {
    low = {minimum(low.x, p.x), minimum(low.y, p.y), minimum(low.z, p.z)};
    high = {maximum(high.x, p.x), maximum(high.y, p.y), maximum(high.z, p.z)};
  }
  return static_cast<double>(norm(high - low));
}

}  // namespace

SimplifiedMesh simplifyMesh(const Mesh& mesh, double max_error_m, const SimplifyProgress& go_on) {
  if (!(max_error_m >= 0.0) || !std::isfinite(max_error_m)) {
    throw std::invalid_argument("the error of a simplified mesh must be a number of metres, or 0");
  }
  if (max_error_m == 0.0 || mesh.triangles.empty()) return {mesh, 0.0};
  const double diagonal_m = diagonalOf(mesh);
  if (max_error_m > diagonal_m) {
    throw std::invalid_argument("an error of " + std::to_string(max_error_m) +
                                " m is more than the whole mesh, which is " +
                                std::to_string(diagonal_m) + " m across");
  }
  return Collapser(mesh, max_error_m, go_on).run();
}

}  // namespace dtsdf
