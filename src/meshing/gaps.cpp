#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "meshing/mend.h"
#include "meshing/mesh_stream.h"

namespace dtsdf {
namespace {

/// Radius of the ball, in voxels. Gaps two voxels wide stay open, since the ball is 1.7 wide.
constexpr float kBallRadius = 0.85f;

/// How often the ball rolls over all edges, including those of triangles from earlier rolls.
constexpr int kRolls = 4;

/// A new triangle may turn by up to an angle with this cosine from the triangle at the edge over
/// which the ball rolls.
constexpr float kMaxTurnCosine = -0.5f;

/// Tolerance for vertices on the ball's surface, as a fraction of its radius.
constexpr float kTolerance = 1e-3f;

/// Rolls a ball over the edges of an outline (Bernardini et al., The Ball-Pivoting Algorithm,
/// TVCG 1999). Where it rests on an edge and on another vertex of an outline, and contains no
/// vertex of an outline, it leaves a triangle. Vertices of kind kFixed are ignored.
class Ball {
 public:
  Ball(const Outline& outline, const std::vector<Vec3f>& positions, float radius,
       std::vector<Outline::Triangle>& patches)
      : outline_(outline),
        positions_(positions),
        radius_(radius),
        patches_(patches),
        open_edges_(outline.rims().size()) {
    listVertices();
    for (const Outline::Rim& rim : outline.rims()) {
      if (isUsable(rim.vertex)) listEdgesFrom(rim);
    }
    for (const Outline::Triangle& triangle : patches_) close(triangle);
  }

  /// Rolls over all edges once. A triangle stays if it is the smallest on each of its edges.
  void roll() {
    for (Edge& edge : edges_) edge.cell = cellKey(middleOf(edge));
    std::sort(edges_.begin(), edges_.end());
    std::vector<Edge> rests;
    rows_.fill(0);
    for (Edge& edge : edges_) {
      if ((state(edge.from, edge.to) & bitOf(kOpen, edge.from, edge.to)) == 0) continue;
      findRest(edge);
      if (edge.rest != Outline::kNone) rests.push_back(edge);
    }
    const auto isSmaller = [](const Edge& a, const Edge& b) {
      return std::tie(a.area, a.from, a.to) < std::tie(b.area, b.from, b.to);
    };
    std::sort(rests.begin(), rests.end(), isSmaller);
    edges_.clear();  // where the ball never rests, it will not rest later
    for (const Edge& edge : rests) {
      const Outline::Triangle triangle{edge.to, edge.from, edge.rest};
      if (take(triangle)) {
        patches_.push_back(triangle);
        close(triangle);
      } else {
        edges_.push_back(edge);
      }
    }
    for (uint8_t& state : states_) state &= static_cast<uint8_t>(~(kTaken | 2 * kTaken));
  }

 private:
  using Point = std::pair<PackedKey, uint32_t>;  ///< The key of a cell, and a vertex in the cell.

  /// An edge on an outline, in the direction of its triangle.
  struct Edge {
    bool operator<(const Edge& other) const {
      return std::tie(cell, from, to) < std::tie(other.cell, other.from, other.to);
    }

    uint32_t from, to, third;  ///< `third`: the triangle's third vertex.
    PackedKey cell = 0;        ///< Key of the cell that contains its middle.
    /// Where the ball rests on the edge, if it does: at this vertex, and in the smallest triangle.
    uint32_t rest = Outline::kNone;
    float area = 0.0f;  ///< Twice the triangle's area.
  };

  /// A vertex near an edge, and its coordinates: x along the normal of the edge's triangle and y
  /// away from that triangle. A ball that rests on the edge contains the vertex if c.x * x + c.y *
  /// y > z, where the unit vector c points from the middle of the edge to the ball's centre.
  using Near = std::pair<uint32_t, Vec3f>;

  const Vec3f& position(uint32_t vertex) const { return positions_[vertex - outline_.first()]; }

  /// Bits of the state of the edge between two vertices. kOpen and kTaken are for the direction
  /// from the lower to the higher vertex; the next bits are for the other direction.
  static constexpr uint8_t kOpen = 1, kTaken = 4, kPatched = 16;

  /// State of an edge; 0 if the edge is new.
  uint8_t& state(uint32_t a, uint32_t b) {
    const auto next = static_cast<uint32_t>(states_.size());
    const uint32_t number =
        numbers_.findOrAdd(uint64_t{std::min(a, b)} << 32 | std::max(a, b), next);
    if (number == next) states_.push_back(0);
    return states_[number];
  }

  static uint8_t bitOf(uint8_t forwards, uint32_t from, uint32_t to) {
    return static_cast<uint8_t>(from < to ? forwards : 2 * forwards);
  }

  bool isUsable(uint32_t vertex) const {
    return vertex >= outline_.first() && outline_.hasRim(vertex) && outline_.isOnOutline(vertex) &&
           !outline_.isUnused(vertex);
  }

  /// Key of the cell that contains a position. Cells are as wide as the ball, and keys repeat every
  /// 2^20 cells.
  PackedKey cellKey(const Vec3f& p) const {
    constexpr int32_t kHalf = 1 << 19, kMask = 2 * kHalf - 1;
    const Vec3i cell = cellOf(p, 2.0f * radius_);
    return packKey({(cell.x + kHalf) & kMask, (cell.y + kHalf) & kMask, (cell.z + kHalf) & kMask});
  }

  void listVertices() {
    for (const Outline::Rim& rim : outline_.rims()) {
      if (isUsable(rim.vertex)) points_.emplace_back(cellKey(position(rim.vertex)), rim.vertex);
    }
    points_.emplace_back(std::numeric_limits<PackedKey>::max(), Outline::kNone);
    std::sort(points_.begin(), points_.end());
  }

  Vec3f middleOf(const Edge& edge) const {
    return 0.5f * (position(edge.from) + position(edge.to));
  }

  void listEdgesFrom(const Outline::Rim& rim) {
    const Outline::Link* const links = outline_.linksOf(rim);
    for (const Outline::Link* link = links; link != links + rim.own; ++link) {
      const auto isBefore = [link](const Outline::Link& l) { return l.previous == link->next; };
      if (std::any_of(links, links + rim.own, isBefore)) continue;
      if (isUsable(link->next) && link->previous >= outline_.first())
        addEdge({rim.vertex, link->next, link->previous});
    }
  }

  void addEdge(const Edge& edge) {
    state(edge.from, edge.to) |= bitOf(kOpen, edge.from, edge.to);
    for (const uint32_t end : {edge.from, edge.to}) ++open_edges_[outline_.rimNumber(end)];
    edges_.push_back(edge);
  }

  /// Removes the edges that a patch closes, and adds its others.
  void close(const Outline::Triangle& triangle) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
      uint8_t& edge = state(a, b);
      const bool was_open = (edge & bitOf(kOpen, b, a)) != 0;
      edge = static_cast<uint8_t>((edge | kPatched) & ~bitOf(kOpen, b, a));
      if (was_open) {
        for (const uint32_t end : {a, b}) --open_edges_[outline_.rimNumber(end)];
      } else {
        addEdge({a, b, triangle[(k + 2) % 3]});
      }
    }
  }

  /// Whether a new triangle may have an edge in this direction.
  bool isFree(uint32_t from, uint32_t to) {
    const uint8_t edge = state(from, to);
    return (edge & bitOf(kOpen, to, from)) != 0 ||
           ((edge & kPatched) == 0 && !outline_.hasEdge(from, to));
  }

  /// Takes the edges of a triangle. @return whether none of them was taken before. Triangles that
  /// do not stay also take their edges, so whether one stays depends only on its neighbours, not on
  /// chains of them (see MeshStream).
  bool take(const Outline::Triangle& triangle) {
    bool is_free = true;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
      uint8_t& edge = state(a, b);
      is_free &= (edge & bitOf(kTaken, a, b)) == 0;
      edge |= bitOf(kTaken, a, b);
    }
    return is_free;
  }

  /// Finds where the ball rests on an edge.
  void findRest(Edge& edge) {
    edge.rest = Outline::kNone;
    const Vec3f from = position(edge.from), along = position(edge.to) - from;
    const Vec3f face = cross(along, position(edge.third) - from);
    const float length = norm(along), face_size = norm(face);
    const float height2 = radius_ * radius_ - 0.25f * length * length;
    if (!(length > 0.0f) || !(face_size > 0.0f) || !(height2 > 0.0f)) return;
    const Vec3f up = (1.0f / face_size) * face;
    findNear(edge, up, (1.0f / length) * cross(along, up), std::sqrt(height2));
    edge.area = std::numeric_limits<float>::infinity();
    for (const auto& [vertex, near] : near_) {
      if (open_edges_[outline_.rimNumber(vertex)] == 0) continue;  // surrounded by now
      const float square = near.x * near.x + near.y * near.y, rest = square - near.z * near.z;
      if (!(rest > 0.0f)) continue;
      const float side = std::sqrt(rest);
      const float x = (near.z * near.x + side * near.y) / square;
      const float y = (near.z * near.y - side * near.x) / square;
      const Vec3f normal = cross(position(vertex) - from, along);
      const float area = norm(normal);
      if (!(area > kTolerance * radius_ * length)) continue;  // such as vertices at one place
      if (area >= edge.area || dot(normal, up) < kMaxTurnCosine * area) continue;
      const auto isInside = [&](const Near& other) {
        const Vec3f& p = other.second;
        return x * p.x + y * p.y > p.z + kTolerance * radius_;
      };
      if (std::any_of(near_.begin(), near_.end(), isInside)) continue;
      if (!isFree(edge.from, vertex) || !isFree(vertex, edge.to)) continue;
      edge.area = area;
      edge.rest = vertex;
    }
  }

  /// @param height Distance from the edge to the centre of a ball that rests on it.
  void findNear(const Edge& edge, const Vec3f& up, const Vec3f& out, float height) {
    const Vec3f middle = middleOf(edge), half = position(edge.to) - middle;
    near_.clear();
    // The cells around an edge form rows of three.
    for (size_t r = 0; r < rows_.size(); ++r) {
      const PackedKey centre =
          edge.cell + kLayerStride * (r / 3) + kRowStride * (r % 3) - kLayerStride - kRowStride;
      while (points_[rows_[r]].first < centre - 1) ++rows_[r];
      for (size_t i = rows_[r]; points_[i].first <= centre + 1; ++i) {
        const uint32_t vertex = points_[i].second;
        const Vec3f p = position(vertex) - middle;
        const float square = dot(p, p);
        if (square >= 4.0f * radius_ * radius_ || vertex == edge.from || vertex == edge.to)
          continue;
        const float limit = 0.5f * (square - dot(half, half)) / height;
        near_.emplace_back(vertex, Vec3f{dot(p, up), dot(p, out), limit});
      }
    }
  }

  const Outline& outline_;
  const std::vector<Vec3f>& positions_;
  const float radius_;
  std::vector<Outline::Triangle>& patches_;
  std::vector<Point> points_;         ///< The vertices on outlines, sorted by cell.
  std::array<size_t, 9> rows_ = {};   ///< Where the rows of cells begin around an edge.
  std::vector<Edge> edges_;           ///< Edges where the ball may rest.
  std::vector<uint32_t> open_edges_;  ///< For each rim, the number of edges on outlines.
  NumberTable numbers_;               ///< Numbers of edges, by their vertices.
  std::vector<uint8_t> states_;       ///< For each number, see state().
  std::vector<Near> near_;            ///< Vertices near the current edge.
};

}  // namespace

void fillGaps(const Outline& outline, const std::vector<Vec3f>& positions, float voxel,
              std::vector<Outline::Triangle>& patches) {
  Ball ball(outline, positions, kBallRadius * voxel, patches);
  for (int n = 0; n < kRolls; ++n) ball.roll();
}

}  // namespace dtsdf
