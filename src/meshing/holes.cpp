#include <algorithm>
#include <limits>
#include <utility>

#include "meshing/mend.h"

namespace dtsdf {
namespace {

/// Holes with more edges are over two voxels across, and stay open.
constexpr int kMaxEdgesOfHole = 8;

constexpr uint32_t kNone = Outline::kNone;
constexpr size_t kBackwards = Outline::kBackwards;

class HoleCloser {
 public:
  HoleCloser(const Outline& outline, const std::vector<Vec3f>& positions,
             const std::vector<Vec3f>& normals, std::vector<Outline::Triangle>& patches)
      : outline_(outline), positions_(positions), normals_(normals), patches_(patches) {}

  /// Closes the holes whose lowest vertex is the vertex of this rim.
  void closeFrom(const Outline::Rim& rim) {
    for (uint32_t k = 0; k < rim.fan_count; ++k) {
      if (!followLoop(rim.vertex, rim.fans[k][kBackwards])) continue;
      const size_t count = patches_.size();
      while (loop_.size() >= 3 && cutCorner()) continue;
      if (loop_.size() >= 3) patches_.resize(count);
    }
  }

 private:
  const Vec3f& position(uint32_t vertex) const { return positions_[vertex - outline_.first()]; }
  const Vec3f& normal(uint32_t vertex) const { return normals_[vertex - outline_.first()]; }

  /// Length of an edge in half edges: 1 if it begins or ends at a midpoint, otherwise 2.
  int halvesOf(uint32_t vertex, uint32_t next) const {
    const auto isMiddle = [this](uint32_t v) { return outline_.kind(v) == Outline::Kind::kMiddle; };
    return isMiddle(vertex) || isMiddle(next) ? 1 : 2;
  }

  /// Follows the loop around a hole, starting with the edge from `lowest` to `next`. @return false
  /// if it is too long for a hole or has a vertex below `lowest`.
  bool followLoop(uint32_t lowest, uint32_t next) {
    loop_.assign(1, lowest);
    int halves = 0;
    uint32_t from = lowest, to = next;
    do {
      if (to == kNone || to < lowest || outline_.kind(to) == Outline::Kind::kFixed) return false;
      loop_.push_back(to);
      halves += halvesOf(from, to);
      if (halves > 2 * kMaxEdgesOfHole) return false;
      from = std::exchange(to, outline_.alongHole(from, to, kBackwards));
    } while (from != lowest || to != next);
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
    patches_.push_back(triangle);
    loop_.erase(loop_.begin() + static_cast<std::ptrdiff_t>(best));
    return true;
  }

  const Outline& outline_;
  const std::vector<Vec3f>& positions_;
  const std::vector<Vec3f>& normals_;
  std::vector<Outline::Triangle>& patches_;  ///< Triangles that fill holes.
  std::vector<uint32_t> loop_;
};

}  // namespace

void closeHolesAndGaps(Outline& outline, uint32_t first, uint32_t end,
                       const std::vector<Vec3f>& positions, const std::vector<Vec3f>& normals,
                       float voxel, const std::function<void(const Outline::Triangle&)>& add) {
  if (first == end) return;
  std::vector<Outline::Triangle> patches;
  HoleCloser closer(outline, positions, normals, patches);
  for (const Outline::Rim& rim : outline.rims()) closer.closeFrom(rim);
  fillGaps(outline, positions, voxel, patches);
  for (Outline::Triangle& t : patches) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  }
  std::sort(patches.begin(), patches.end());
  for (const Outline::Triangle& triangle : patches) {
    if (triangle[0] < first || triangle[0] >= end) continue;
    outline.patch(triangle);
    add(triangle);
  }
}

}  // namespace dtsdf
