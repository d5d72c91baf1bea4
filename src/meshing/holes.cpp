#include <algorithm>
#include <limits>
#include <utility>

#include "meshing/mend.h"

namespace dtsdf {
namespace {

/// Holes with more edges are over two voxels across, and stay open.
constexpr int kMaxEdgesOfHole = 8;

/// Maximum length of a bridge across a crack, in voxels. Wider gaps are usually real.
constexpr float kMaxBridge = 1.5f;

constexpr uint32_t kNone = Outline::kNone;
constexpr size_t kForwards = Outline::kForwards, kBackwards = Outline::kBackwards;

/// A vertex where a bridge may end.
struct BridgeEnd {
  bool isCloser(float length, uint32_t other) const {
    return length < shortest || (length == shortest && other < nearest);
  }

  uint32_t vertex;
  Vec3f position, inwards;  ///< `inwards`: sum of the vectors to the vertex's neighbours.
  float shortest;           ///< Squared length of the shortest bridge.
  uint32_t nearest;         ///< The vertex at the other end of that bridge.
  int is_on_hole;           ///< Negative if not yet known.
};

class HoleCloser {
 public:
  HoleCloser(Outline& outline, const std::vector<Vec3f>& positions,
             const std::vector<Vec3f>& normals, float max_bridge)
      : outline_(outline), positions_(positions), normals_(normals), max_bridge_(max_bridge) {
    findBridges();
  }

  /// Closes the holes whose lowest vertex is the vertex of this rim.
  template <class Add>
  void closeFrom(const Outline::Rim& rim, const Add& add) {
    for (uint32_t k = 0; k < rim.fan_count; ++k) {
      close(rim.vertex, rim.vertex, rim.fans[k][kBackwards], add);
    }
    // The first step from a loop's lowest vertex may also lead across a bridge.
    const uint32_t across = bridgeFrom(rim.vertex);
    if (across == kNone || across < rim.vertex) return;
    close(rim.vertex, across, outline_.rimOf(across).fans[0][kBackwards], add);
  }

 private:
  using Cell = std::pair<PackedKey, uint32_t>;  ///< The key of a cell, and a vertex in the cell.

  const Vec3f& position(uint32_t vertex) const { return positions_[vertex - outline_.first()]; }
  const Vec3f& normal(uint32_t vertex) const { return normals_[vertex - outline_.first()]; }

  /// Length of an edge in half edges: 1 if it begins or ends at a midpoint, otherwise 2.
  int halvesOf(uint32_t vertex, uint32_t next) const {
    const auto isMiddle = [this](uint32_t v) { return outline_.kind(v) == Outline::Kind::kMiddle; };
    return isMiddle(vertex) || isMiddle(next) ? 1 : 2;
  }

  /// Whether the outline leads from vertex `from` to `to` within `max_edges` edges. Both may be the
  /// same vertex. @pre `from` has exactly one fan (see Outline).
  bool leads(uint32_t from, uint32_t to, size_t way, int max_edges) const {
    uint32_t before = from, next = outline_.rimOf(from).fans[0][way];
    for (int halves = 0; next != kNone && next >= outline_.first();) {
      halves += halvesOf(before, next);
      if (halves > 2 * max_edges) return false;
      if (next == to) return true;
      before = std::exchange(next, outline_.alongHole(before, next, way));
    }
    return false;
  }

  /// Key of the cell that contains a position. Cells are as wide as the longest bridge, and keys
  /// repeat every 2^20 cells.
  PackedKey cellKey(const Vec3f& p) const {
    constexpr int32_t kHalf = 1 << 19, kMask = 2 * kHalf - 1;
    const Vec3i cell = cellOf(p, max_bridge_);
    return packKey({(cell.x + kHalf) & kMask, (cell.y + kHalf) & kMask, (cell.z + kHalf) & kMask});
  }

  /// Lists the vertices of kind kPlain with exactly one fan, sorted by cell. The last entry has no
  /// vertex and marks the end.
  std::vector<Cell> sortedCells() const {
    std::vector<Cell> cells;
    for (const Outline::Rim& rim : outline_.rims()) {
      if (rim.fan_count != 1 || outline_.kind(rim.vertex) != Outline::Kind::kPlain) continue;
      cells.emplace_back(cellKey(position(rim.vertex)), rim.vertex);
    }
    cells.emplace_back(std::numeric_limits<PackedKey>::max(), kNone);
    std::sort(cells.begin(), cells.end());
    return cells;
  }

  BridgeEnd bridgeEnd(uint32_t vertex) const {
    const Vec3f& p = position(vertex);
    Vec3f inwards{0.0f, 0.0f, 0.0f};
    const Outline::Rim& rim = outline_.rimOf(vertex);
    for (uint32_t n = 0; n < rim.own; ++n) {
      const Outline::Link& link = outline_.linksOf(rim)[n];
      for (const uint32_t v : {link.next, link.previous}) {
        if (v >= outline_.first()) inwards = inwards + (position(v) - p);
      }
    }
    return {vertex, p, inwards, max_bridge_ * max_bridge_, kNone, -1};
  }

  bool isOnHole(BridgeEnd& end) const {
    if (end.is_on_hole < 0) {
      end.is_on_hole = leads(end.vertex, end.vertex, kBackwards, kMaxEdgesOfHole) ? 1 : 0;
    }
    return end.is_on_hole == 1;
  }

  /// Whether a bridge may join two vertices that face each other: neither is on a hole, and they
  /// are not so close along one outline that both might be on the same hole.
  bool isBridge(BridgeEnd& end, BridgeEnd& other) const {
    if (dot(normal(end.vertex), normal(other.vertex)) <= 0.0f) return false;
    const auto isNear = [&](size_t way) {
      return leads(end.vertex, other.vertex, way, kMaxEdgesOfHole / 2);
    };
    return !isNear(kForwards) && !isNear(kBackwards) &&  // the usual reasons come first
           !outline_.hasEdge(end.vertex, other.vertex) && !isOnHole(end) && !isOnHole(other);
  }

  void consider(BridgeEnd& a, BridgeEnd& b) const {
    const Vec3f bridge = b.position - a.position;
    const float length = dot(bridge, bridge);
    // Whether each vertex lies beyond the edge of the surface around the other. This is rarely
    // true, so all conditions share one branch.
    const int is_facing = static_cast<int>(dot(bridge, a.inwards) < 0.0f) &
                          static_cast<int>(dot(bridge, b.inwards) > 0.0f) &
                          static_cast<int>(length <= std::max(a.shortest, b.shortest));
    if (is_facing == 0) return;
    const bool is_closer[2] = {a.isCloser(length, b.vertex), b.isCloser(length, a.vertex)};
    if (!(is_closer[0] || is_closer[1]) || !isBridge(a, b)) return;
    if (is_closer[0]) a.shortest = length, a.nearest = b.vertex;
    if (is_closer[1]) b.shortest = length, b.nearest = a.vertex;
  }

  /// For each vertex where a bridge may end, finds the nearest vertex for its other end.
  void findBridges() {
    const std::vector<Cell> cells = sortedCells();
    std::vector<BridgeEnd> ends(cells.size() - 1);
    for (size_t i = 0; i < ends.size(); ++i) ends[i] = bridgeEnd(cells[i].second);
    // The cells around a vertex form rows of three. kRows holds the key of each row's middle cell,
    // relative to the key of the vertex's own cell. Rows whose vertices come earlier in `cells` are
    // left out, since each pair of vertices is considered only once.
    constexpr PackedKey kRows[] = {0, kRowStride, kLayerStride - kRowStride, kLayerStride,
                                   kLayerStride + kRowStride};
    size_t row[std::size(kRows)] = {};
    for (size_t i = 0; i < ends.size(); ++i) {
      row[0] = i + 1;
      for (size_t r = 0; r < std::size(kRows); ++r) {
        const PackedKey middle = cells[i].first + kRows[r];
        while (cells[row[r]].first < middle - 1) ++row[r];
        for (size_t j = row[r]; cells[j].first <= middle + 1; ++j) consider(ends[i], ends[j]);
      }
    }
    nearest_.assign(outline_.rims().size(), kNone);
    for (const BridgeEnd& end : ends) nearest_[outline_.rimNumber(end.vertex)] = end.nearest;
  }

  /// The other end of the bridge at a vertex; kNone if there is no bridge.
  uint32_t bridgeFrom(uint32_t vertex) const {
    const auto nearest = [this](uint32_t v) {
      return outline_.hasRim(v) ? nearest_[outline_.rimNumber(v)] : kNone;
    };
    const uint32_t other = nearest(vertex);
    return other != kNone && nearest(other) == vertex ? other : kNone;
  }

  /// Follows the loop around a hole, across bridges, starting with the edge from `vertex` to
  /// `next`. @return false if it is too long for a hole or has a vertex below `lowest`.
  bool followLoop(uint32_t lowest, uint32_t vertex, uint32_t next) {
    loop_.assign(1, vertex);
    int halves = 0;
    uint32_t from = vertex, to = next;
    do {
      if (to == kNone || to < lowest || outline_.kind(to) == Outline::Kind::kFixed) return false;
      loop_.push_back(to);
      halves += halvesOf(from, to);
      const uint32_t across = bridgeFrom(to);
      if (across != kNone) {
        if (across < lowest) return false;
        loop_.push_back(across);
        halves += 2;
        from = across;
        to = outline_.rimOf(across).fans[0][kBackwards];
      } else {
        from = std::exchange(to, outline_.alongHole(from, to, kBackwards));
      }
      if (halves > 2 * kMaxEdgesOfHole) return false;
    } while (from != vertex || to != next);
    loop_.pop_back();
    std::vector<uint32_t> sorted = loop_;
    std::sort(sorted.begin(), sorted.end());
    return loop_.size() >= 3 && std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  }

  /// Cuts one corner off the loop. Among the corners whose triangle faces the same way as the
  /// surface, chooses the one whose neighbours are closest together. @return whether a corner was
  /// cut.
  bool cutCorner() {
    const size_t count = loop_.size();
    size_t best = count;
    float shortest = std::numeric_limits<float>::infinity();
    Outline::Triangle triangle{};
    for (size_t i = 0; i < count; ++i) {
      const Outline::Triangle t{loop_[(i + count - 1) % count], loop_[i], loop_[(i + 1) % count]};
      const Vec3f& p = position(t[0]);
      const Vec3f across = position(t[2]) - p;
      const Vec3f n = cross(position(t[1]) - p, across);
      if (!(dot(n, normal(t[1])) > 0.0f) || norm(across) >= shortest) continue;
      if (count > 3 && outline_.hasEdge(t[0], t[2])) continue;
      shortest = norm(across);
      best = i;
      triangle = t;
    }
    if (best == count) return false;
    triangles_.push_back(triangle);
    loop_.erase(loop_.begin() + static_cast<std::ptrdiff_t>(best));
    return true;
  }

  /// Fills the loop found by followLoop() with triangles, if that is possible.
  template <class Add>
  void close(uint32_t lowest, uint32_t vertex, uint32_t next, const Add& add) {
    if (next < lowest || !followLoop(lowest, vertex, next)) return;
    triangles_.clear();
    while (loop_.size() >= 3 && cutCorner()) continue;
    if (loop_.size() >= 3) return;
    for (const Outline::Triangle& triangle : triangles_) {
      outline_.patch(triangle);
      add(triangle);
    }
  }

  Outline& outline_;
  const std::vector<Vec3f>& positions_;
  const std::vector<Vec3f>& normals_;
  const float max_bridge_;
  std::vector<uint32_t> nearest_;  ///< For each rim, the nearest vertex across a crack.
  std::vector<uint32_t> loop_;
  std::vector<Outline::Triangle> triangles_;  ///< Triangles that fill the loop.
};

}  // namespace

void closeHoles(Outline& outline, uint32_t first, uint32_t end, const std::vector<Vec3f>& positions,
                const std::vector<Vec3f>& normals, float voxel,
                const std::function<void(const Outline::Triangle&)>& add) {
  if (first == end) return;
  HoleCloser closer(outline, positions, normals, kMaxBridge * voxel);
  const size_t end_rim = outline.rimFrom(end);
  for (size_t n = outline.rimFrom(first); n < end_rim; ++n) {
    closer.closeFrom(outline.rims()[n], add);
  }
}

}  // namespace dtsdf
