#include "meshing/outline.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "kernels/core/grid.h"
#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

constexpr int kStepsAlong = 2;

/// A line whose ends are closer together than this share of its length turns back: it is the tip of
/// something narrow, which smoothing would shorten.
constexpr float kMinExtent = 0.4f;

/// Pieces of more triangles are no crumbs. (If refined, of four times as many.)
constexpr size_t kMaxCrumb = 16;
/// A crumb stays if no larger piece is this near along each axis, in voxels.
constexpr float kCrumbReach = 4.0f;
/// It also stays if small pieces this near, in voxels, make it larger, as along a narrow slat.
constexpr float kNextPiece = 1.5f;

/// Holes with more edges, which are over two voxels across, stay open.
constexpr int kMaxEdgesOfHole = 8;

/// Length of a bridge over a crack, in voxels. Wider gaps are usually real.
constexpr float kMaxBridge = 1.5f;

Vec3i cellOf(const Vec3f& position, float side) {
  const Vec3f scaled = (1.0f / side) * position;
  return {floorToInt(scaled.x), floorToInt(scaled.y), floorToInt(scaled.z)};
}

/// A linear hash would cancel where the end numbers of two fans differ equally, as on a grid.
uint32_t hash(uint32_t number) {
  const uint32_t product = number * 0x9e3779b9u;
  return product ^ (product >> 15);
}

/// A number for a cell; cells far apart may have the same.
uint64_t hashOf(const Vec3i& cell) {
  constexpr uint64_t kFactor = 0x9e3779b97f4a7c15u;
  return ((static_cast<uint64_t>(cell.x) * kFactor + static_cast<uint64_t>(cell.y)) * kFactor) +
         static_cast<uint64_t>(cell.z);
}

/// The same triangle, listed from its lowest vertex.
Outline::Triangle fromLowest(Outline::Triangle triangle) {
  std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  return triangle;
}

}  // namespace

/// The surface as close() reads it, with the longest bridge.
struct Outline::Surface {
  const Vec3f& position(uint32_t vertex) const { return positions[vertex - first]; }
  const Vec3f& normal(uint32_t vertex) const { return normals[vertex - first]; }

  uint32_t first;
  const std::vector<Vec3f>& positions;
  const std::vector<Vec3f>& normals;
  float max_bridge;
};

/// A vertex where a bridge may end.
struct Outline::BridgeEnd {
  bool isCloser(float length, uint32_t other) const {
    return length < shortest || (length == shortest && other < nearest);
  }

  auto order() const { return std::tie(cell.z, cell.y, cell.x, vertex); }

  Vec3i cell;
  uint32_t vertex;
  Vec3f inwards;             ///< Sum of vectors to its neighbours.
  float shortest;            ///< Squared.
  uint32_t nearest = kNone;  ///< The vertex at this distance.
};

void Outline::addTriangle(const Triangle& triangle) {
  for (int k = 0; k < 3; ++k) {
    Vertex& vertex = at(triangle[k]);
    vertex.sum += hash(triangle[(k + 1) % 3]) - hash(triangle[(k + 2) % 3]);
    vertex.is_used = true;
  }
}

void Outline::forget(uint32_t first) {
  const auto end = vertices_.begin() + (first - first_);
  for (auto vertex = vertices_.begin(); vertex != end; ++vertex) {
    if (vertex->rim == kNone) continue;
    rims_.pop_front();
    ++first_rim_;
  }
  vertices_.erase(vertices_.begin(), end);
  first_ = first;
}

void Outline::link(uint32_t first, uint32_t end, const std::vector<Triangle>& triangles) {
  constexpr size_t kUsualLinks = 4;
  for (uint32_t i = first; i < end; ++i) {
    const bool is_inside = at(i).sum == 0 && at(i).kind != Kind::kMiddle;
    if (is_inside || at(i).kind == Kind::kFixed) continue;
    at(i).rim = first_rim_ + static_cast<uint32_t>(rims_.size());
    rims_.emplace_back();
    rims_.back().links.reserve(kUsualLinks);
  }
  for (const Triangle& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] < first || t[k] >= end || !hasRim(t[k])) continue;
      Rim& rim = rimOf(t[k]);
      rim.links.push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
      ++rim.own;
    }
  }
}

/// Whether a triangle, but none that close() added, has an edge between two vertices.
/// @pre `a` is on an outline.
bool Outline::hasEdge(uint32_t a, uint32_t b) const {
  const Rim& rim = rimOf(a);
  return std::any_of(rim.links.begin(), rim.links.begin() + rim.own,
                     [b](const Link& link) { return link.next == b || link.previous == b; });
}

/// The fans of some links.
Outline::Fans Outline::fansOfLinks(const Link* links, int count) {
  Fans fans{0, {}};
  const auto follow = [&](uint32_t next) {
    for (int i = 0; i < count; ++i) {
      if (links[i].next == next) return links[i].previous;
    }
    return kNone;
  };
  for (int i = 0; i < count; ++i) {
    bool is_first = true;
    for (int k = 0; k < count; ++k) is_first = is_first && links[k].previous != links[i].next;
    if (!is_first) continue;
    if (++fans.count == 3) return {0, {}};
    uint32_t last = links[i].previous;
    for (int steps = 0; steps < count && follow(last) != kNone; ++steps) last = follow(last);
    fans.ends[static_cast<size_t>(fans.count - 1)] = {links[i].next, last};
  }
  return fans;
}

/// The fans around a vertex, without those that close() added or with them.
const Outline::Fans& Outline::fansOf(uint32_t vertex, bool is_closed) const {
  static const Fans kNoFans{0, {}};
  if (!hasRim(vertex)) return kNoFans;
  Rim& rim = rimOf(vertex);
  const int count = is_closed ? static_cast<int>(rim.links.size()) : rim.own;
  Fans& fans = rim.fans[count > rim.own ? 1 : 0];
  if (fans.count < 0) fans = fansOfLinks(rim.links.data(), count);
  return fans;
}

/// The next vertex on the outline after close(); kNone: it ends there, or meets another one.
uint32_t Outline::beside(uint32_t vertex, size_t way) const {
  if (vertex < first_ || at(vertex).kind == Kind::kFixed) return kNone;
  const Fans& fans = fansOf(vertex, true);
  return fans.count == 1 ? fans.ends[0][way] : kNone;
}

/// The next vertex on the outline that is not the midpoint of a side.
uint32_t Outline::nextOnEdge(uint32_t vertex, size_t way) const {
  const uint32_t next = beside(vertex, way);
  return next != kNone && at(next).kind == Kind::kMiddle ? beside(next, way) : next;
}

/// The vertex after `vertex` around a hole before close(), coming from `before`. Where two fans
/// meet, a hole lies between them. kNone: fixed, or more fans meet.
uint32_t Outline::alongHole(uint32_t before, uint32_t vertex, size_t way) const {
  if (vertex < first_ || at(vertex).kind == Kind::kFixed) return kNone;
  const Fans& fans = fansOf(vertex);
  const size_t other = way == kForwards ? kBackwards : kForwards;
  for (int i = 0; i < fans.count; ++i) {
    if (fans.ends[i][other] == before) return fans.ends[fans.count - 1 - i][way];
  }
  return kNone;
}

/// Adds the triangles that share vertices with those of a piece. @return whether it is small, and
/// `first` the lowest of its vertices on outlines. Each side needs a vertex with a rim, which lists
/// the triangles at it.
bool Outline::growPiece(uint32_t first, std::vector<Triangle>& piece) const {
  size_t most = kMaxCrumb;
  for (size_t i = 0; i < piece.size(); ++i) {
    const Triangle t = piece[i];
    int without_rim = 0;
    for (const uint32_t v : t) {
      if (v < first_ || at(v).kind == Kind::kFixed || (v < first && at(v).sum != 0)) return false;
      if (at(v).kind == Kind::kMiddle) most = 4 * kMaxCrumb;
      if (!hasRim(v) && ++without_rim == 2) return false;
    }
    for (const uint32_t v : t) {
      if (!hasRim(v)) continue;
      const Rim& rim = rimOf(v);
      for (int n = 0; n < rim.own; ++n) {
        const Link& link = rim.links[static_cast<size_t>(n)];
        const Triangle at_vertex = fromLowest({v, link.next, link.previous});
        if (std::find(piece.begin(), piece.end(), at_vertex) == piece.end()) {
          piece.push_back(at_vertex);
        }
      }
    }
    if (piece.size() > most) return false;
  }
  return true;
}

bool Outline::hasMidpoint(const std::vector<Triangle>& piece) const {
  for (const Triangle& triangle : piece) {
    for (const uint32_t v : triangle) {
      if (at(v).kind == Kind::kMiddle) return true;
    }
  }
  return false;
}

void Outline::removeTriangle(const Triangle& triangle) {
  for (int k = 0; k < 3; ++k) {
    at(triangle[k]).is_used = false;
    if (!hasRim(triangle[k])) continue;
    Rim& rim = rimOf(triangle[k]);
    const Link link{triangle[(k + 1) % 3], triangle[(k + 2) % 3]};
    rim.links.erase(std::find(rim.links.begin(), rim.links.end(), link));
    --rim.own;
    rim.fans[0] = {};
  }
}

/// The pieces of few triangles.
std::vector<std::vector<Outline::Triangle>> Outline::smallPieces() const {
  std::vector<std::vector<Triangle>> pieces;
  std::vector<Triangle> piece;
  for (uint32_t i = first_; i < first_ + vertices_.size(); ++i) {
    if (!hasRim(i) || at(i).sum == 0 || rimOf(i).own == 0) continue;
    const Link& link = rimOf(i).links[0];
    piece = {fromLowest({i, link.next, link.previous})};
    if (growPiece(i, piece)) pieces.push_back(piece);
  }
  return pieces;
}

void Outline::removeCrumbs(uint32_t first, uint32_t end, const std::vector<Vec3f>& positions,
                           float voxel) {
  if (first == end) return;
  const float reach = kCrumbReach * voxel;
  const std::vector<std::vector<Triangle>> pieces = smallPieces();
  std::vector<size_t> piece_of(vertices_.size(), pieces.size());
  std::vector<uint8_t> is_near_larger(pieces.size());
  std::vector<std::vector<size_t>> next_to(pieces.size());
  // What is within reach of each piece, and the pieces by the cells that this overlaps.
  std::vector<std::array<Vec3f, 2>> boxes;
  std::unordered_map<uint64_t, std::vector<size_t>> pieces_at;
  for (size_t n = 0; n < pieces.size(); ++n) {
    Vec3f low = positions[pieces[n][0][0] - first_], high = low;
    uint32_t lowest = end;
    for (const Triangle& triangle : pieces[n]) {
      for (const uint32_t v : triangle) {
        piece_of[v - first_] = n;
        if (at(v).sum != 0) lowest = std::min(lowest, v);
        low = minOf(low, positions[v - first_]);
        high = maxOf(high, positions[v - first_]);
      }
    }
    boxes.push_back({low - Vec3f{reach, reach, reach}, high + Vec3f{reach, reach, reach}});
    if (lowest < first || lowest >= end) continue;
    const Vec3i begin = cellOf(boxes[n][0], reach), last = cellOf(boxes[n][1], reach);
    for (Vec3i cell = begin; cell.z <= last.z; ++cell.z) {
      for (cell.y = begin.y; cell.y <= last.y; ++cell.y) {
        for (cell.x = begin.x; cell.x <= last.x; ++cell.x) {
          pieces_at[hashOf(cell)].push_back(n);
        }
      }
    }
  }
  if (pieces_at.empty()) return;
  Vec3i cell{0, 0, 0};
  auto found = pieces_at.find(hashOf(cell));
  for (uint32_t i = first_; i < first_ + vertices_.size(); ++i) {
    if (isUnused(i)) continue;
    const Vec3f& p = positions[i - first_];
    const Vec3i next = cellOf(p, reach);
    if (!(next == cell)) found = pieces_at.find(hashOf(next));  // seldom: neighbours share cells
    cell = next;
    if (found == pieces_at.end()) continue;
    const size_t own = piece_of[i - first_];
    for (const size_t n : found->second) {
      const Vec3f inside = minOf(p - boxes[n][0], boxes[n][1] - p);
      const float depth = std::min({inside.x, inside.y, inside.z});
      if (own == pieces.size()) {
        if (depth >= 0.0f) is_near_larger[n] = 1;
      } else if (own != n && depth >= reach - kNextPiece * voxel) {
        std::vector<size_t>& others = next_to[n];
        if (std::find(others.begin(), others.end(), own) == others.end()) others.push_back(own);
      }
    }
  }
  for (size_t n = 0; n < pieces.size(); ++n) {
    size_t together = pieces[n].size();
    for (const size_t other : next_to[n]) together += pieces[other].size();
    const size_t most = hasMidpoint(pieces[n]) ? 4 * kMaxCrumb : kMaxCrumb;
    if (is_near_larger[n] == 0 || together > most) continue;
    for (const Triangle& triangle : pieces[n]) removeTriangle(triangle);
  }
}

bool Outline::isCrumb(const Triangle& triangle) const {
  const auto has_rim = [this](uint32_t vertex) { return hasRim(vertex); };
  if (std::count_if(triangle.begin(), triangle.end(), has_rim) < 2) return false;
  const int k = has_rim(triangle[0]) ? 0 : 1;
  const std::vector<Link>& links = rimOf(triangle[k]).links;
  const Link link{triangle[k + 1], triangle[(k + 2) % 3]};
  return std::find(links.begin(), links.end(), link) == links.end();
}

bool Outline::isUnused(uint32_t vertex) const {
  return hasRim(vertex) ? rimOf(vertex).links.empty() : !at(vertex).is_used;
}

/// 2 for an edge; 1 for half of one, which a midpoint ends.
int Outline::halvesOf(uint32_t vertex, uint32_t next) const {
  return at(vertex).kind == Kind::kMiddle || at(next).kind == Kind::kMiddle ? 1 : 2;
}

/// Whether an outline leads from a vertex with one fan to another, or back to it, within some
/// edges.
bool Outline::leads(uint32_t from, uint32_t to, size_t way, int max_edges) const {
  uint32_t before = from, next = fansOf(from).ends[0][way];
  for (int halves = 0; next != kNone && next >= first_;) {
    halves += halvesOf(before, next);
    if (halves > 2 * max_edges) return false;
    if (next == to) return true;
    before = std::exchange(next, alongHole(before, next, way));
  }
  return false;
}

/// The plain vertices in one fan, sorted by cells as wide as the longest bridge.
std::vector<Outline::BridgeEnd> Outline::bridgeEnds(const Surface& surface) const {
  std::vector<BridgeEnd> ends;
  for (uint32_t i = first_; i < first_ + vertices_.size(); ++i) {
    if (!hasRim(i) || at(i).kind != Kind::kPlain || fansOf(i).count != 1) continue;
    const Vec3f& p = surface.position(i);
    Vec3f inwards{0.0f, 0.0f, 0.0f};
    for (int k = 0; k < rimOf(i).own; ++k) {
      const Link& link = rimOf(i).links[k];
      for (const uint32_t v : {link.next, link.previous}) {
        if (v >= first_) inwards = inwards + (surface.position(v) - p);
      }
    }
    ends.push_back(
        {cellOf(p, surface.max_bridge), i, inwards, surface.max_bridge * surface.max_bridge});
  }
  std::sort(ends.begin(), ends.end(),
            [](const BridgeEnd& a, const BridgeEnd& b) { return a.order() < b.order(); });
  return ends;
}

/// Whether a bridge may join two vertices: each lies outside the surface around the other, neither
/// is on a hole, and they are not so close on an outline that both might be on one hole.
bool Outline::isBridge(const BridgeEnd& end, const BridgeEnd& other, const Surface& surface) const {
  const Vec3f bridge = surface.position(other.vertex) - surface.position(end.vertex);
  if (dot(bridge, end.inwards) >= 0.0f || dot(bridge, other.inwards) <= 0.0f) return false;
  if (dot(surface.normal(end.vertex), surface.normal(other.vertex)) <= 0.0f) return false;
  if (hasEdge(end.vertex, other.vertex)) return false;
  for (const size_t way : {kForwards, kBackwards}) {
    if (leads(end.vertex, other.vertex, way, kMaxEdgesOfHole / 2)) return false;
  }
  return !leads(end.vertex, end.vertex, kBackwards, kMaxEdgesOfHole) &&
         !leads(other.vertex, other.vertex, kBackwards, kMaxEdgesOfHole);
}

/// Finds the vertex nearest to each where a bridge may end.
void Outline::findBridges(const Surface& surface) {
  std::vector<BridgeEnd> ends = bridgeEnds(surface);
  const auto consider = [&](uint32_t i, uint32_t j) {
    BridgeEnd &a = ends[i], &b = ends[j];
    const Vec3f bridge = surface.position(b.vertex) - surface.position(a.vertex);
    const float length = dot(bridge, bridge);
    const bool is_closer[2] = {a.isCloser(length, b.vertex), b.isCloser(length, a.vertex)};
    if (!(is_closer[0] || is_closer[1]) || !isBridge(a, b, surface)) return;
    if (is_closer[0]) a.shortest = length, a.nearest = b.vertex;
    if (is_closer[1]) b.shortest = length, b.nearest = a.vertex;
  };
  // Of the rows of cells around a vertex, those with greater keys hold the vertices not yet
  // paired with it.
  constexpr int kRows = 5;
  constexpr Vec3i kRowStart[kRows] = {{0, 0, 0}, {-1, 1, 0}, {-1, -1, 1}, {-1, 0, 1}, {-1, 1, 1}};
  uint32_t row[kRows] = {};
  for (uint32_t i = 0; i < ends.size(); ++i) {
    row[0] = i + 1;
    for (int r = 0; r < kRows; ++r) {
      const Vec3i low = ends[i].cell + kRowStart[r];
      const auto isBefore = [&](uint32_t j) {
        const Vec3i& cell = ends[j].cell;
        return std::tie(cell.z, cell.y, cell.x) < std::tie(low.z, low.y, low.x);
      };
      while (row[r] < ends.size() && isBefore(row[r])) ++row[r];
      for (uint32_t j = row[r]; j < ends.size(); ++j) {
        const Vec3i& cell = ends[j].cell;
        if (cell.z != low.z || cell.y != low.y || cell.x > ends[i].cell.x + 1) break;
        consider(i, j);
      }
    }
  }
  for (Rim& rim : rims_) rim.bridge = kNone;
  for (const BridgeEnd& end : ends) rimOf(end.vertex).bridge = end.nearest;
}

/// The other end of the bridge at a vertex; kNone: it has none.
uint32_t Outline::bridgeFrom(uint32_t vertex) const {
  const uint32_t other = hasRim(vertex) ? rimOf(vertex).bridge : kNone;
  return other != kNone && rimOf(other).bridge == vertex ? other : kNone;
}

/// The loop around a hole that begins with the edge from `vertex` to `next` and crosses bridges.
/// @return false if it is too long for a hole or has a vertex below `lowest`.
bool Outline::followLoop(uint32_t lowest, uint32_t vertex, uint32_t next, Loop& loop) const {
  loop = {vertex};
  int halves = 0;
  uint32_t from = vertex, to = next;
  do {
    if (to == kNone || to < lowest || at(to).kind == Kind::kFixed) return false;
    loop.push_back(to);
    halves += halvesOf(from, to);
    const uint32_t across = bridgeFrom(to);
    if (across != kNone) {
      if (across < lowest) return false;
      loop.push_back(across);
      halves += 2;
      from = across;
      to = fansOf(across).ends[0][kBackwards];
    } else {
      from = std::exchange(to, alongHole(from, to, kBackwards));
    }
    if (halves > 2 * kMaxEdgesOfHole) return false;
  } while (from != vertex || to != next);
  loop.pop_back();
  Loop sorted = loop;
  std::sort(sorted.begin(), sorted.end());
  return loop.size() >= 3 && std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
}

/// Cuts one corner off a loop: of those whose triangle faces the same way as the surface, the one
/// whose neighbours are closest to each other. @return whether there was one.
bool Outline::cutCorner(Loop& loop, const Surface& surface,
                        std::vector<Triangle>& triangles) const {
  const size_t count = loop.size();
  size_t best = count;
  float shortest = std::numeric_limits<float>::infinity();
  Triangle triangle{};
  for (size_t i = 0; i < count; ++i) {
    const Triangle t{loop[(i + count - 1) % count], loop[i], loop[(i + 1) % count]};
    const Vec3f& p = surface.position(t[0]);
    const Vec3f across = surface.position(t[2]) - p;
    const Vec3f n = cross(surface.position(t[1]) - p, across);
    if (!(dot(n, surface.normal(t[1])) > 0.0f) || norm(across) >= shortest) continue;
    if (count > 3 && hasEdge(t[0], t[2])) continue;
    shortest = norm(across);
    best = i;
    triangle = t;
  }
  if (best == count) return false;
  triangles.push_back(triangle);
  loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(best));
  return true;
}

void dropUnusedVertices(Mesh& mesh) {
  constexpr uint32_t kUnused = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> number(mesh.vertices_m.size(), kUnused);
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t v : triangle) number[v] = 0;
  }
  uint32_t count = 0;
  for (size_t i = 0; i < number.size(); ++i) {
    if (number[i] == kUnused) continue;
    mesh.vertices_m[count] = mesh.vertices_m[i];
    mesh.normals[count] = mesh.normals[i];
    if (!mesh.colours.empty()) mesh.colours[count] = mesh.colours[i];
    number[i] = count++;
  }
  mesh.vertices_m.resize(count);
  mesh.normals.resize(count);
  if (!mesh.colours.empty()) mesh.colours.resize(count);
  for (auto& triangle : mesh.triangles) {
    for (uint32_t& v : triangle) v = number[v];
  }
}

void Outline::mend(Mesh& mesh, float voxel) {
  const auto count = static_cast<uint32_t>(mesh.vertices_m.size());
  link(0, count, mesh.triangles);
  removeCrumbs(0, count, mesh.vertices_m, voxel);
  close(0, count, mesh.vertices_m, mesh.normals, voxel,
        [&](const Triangle& triangle) { mesh.triangles.push_back(triangle); });
  std::vector<std::pair<uint32_t, Vec3f>> moved;
  for (uint32_t i = 0; i < count; ++i) {
    if (hasRim(i)) moved.emplace_back(i, smoothed(i, mesh.vertices_m));
  }
  for (const auto& [i, position] : moved) mesh.vertices_m[i] = position;
  const auto is_crumb = [this](const Triangle& triangle) { return isCrumb(triangle); };
  mesh.triangles.erase(std::remove_if(mesh.triangles.begin(), mesh.triangles.end(), is_crumb),
                       mesh.triangles.end());
  dropUnusedVertices(mesh);
}

void Outline::close(uint32_t first, uint32_t end, const std::vector<Vec3f>& positions,
                    const std::vector<Vec3f>& normals, float voxel,
                    const std::function<void(const Triangle&)>& add) {
  if (first == end) return;
  const Surface surface{first_, positions, normals, kMaxBridge * voxel};
  findBridges(surface);
  Loop loop;
  std::vector<Triangle> triangles;
  const auto closeLoop = [&](uint32_t lowest, uint32_t vertex, uint32_t next) {
    if (!followLoop(lowest, vertex, next, loop)) return;
    triangles.clear();
    while (loop.size() >= 3 && cutCorner(loop, surface, triangles)) continue;
    if (loop.size() >= 3) return;
    for (const Triangle& t : triangles) {
      for (int k = 0; k < 3; ++k) {
        Rim& rim = rimOf(t[k]);
        rim.links.push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
        rim.fans[1] = {};
      }
      add(t);
    }
  };
  for (uint32_t i = first; i < end; ++i) {
    if (!hasRim(i)) continue;
    const Fans& fans = fansOf(i);
    for (int k = 0; k < fans.count; ++k) {
      closeLoop(i, i, fans.ends[k][kBackwards]);
    }
    // A loop may leave its lowest vertex over a bridge.
    const uint32_t across = bridgeFrom(i);
    if (across == kNone || across < i) continue;
    closeLoop(i, across, fansOf(across).ends[0][kBackwards]);
  }
}

Vec3f Outline::shiftOf(uint32_t vertex, const std::vector<Vec3f>& positions) const {
  const auto position = [&](uint32_t of) { return positions[of - first_]; };
  const Vec3f p = position(vertex);
  Vec3f ends[2] = {p, p};
  uint32_t at[2] = {vertex, vertex};
  Vec3f from_vertex[kStepsAlong] = {};  // sum over both ways
  float length = 0.0f;
  int steps = 0;
  while (steps < kStepsAlong) {
    for (const size_t way : {kForwards, kBackwards}) at[way] = nextOnEdge(at[way], way);
    if (at[kForwards] == kNone || at[kBackwards] == kNone) break;
    for (const size_t way : {kForwards, kBackwards}) {
      length += norm(position(at[way]) - ends[way]);
      ends[way] = position(at[way]);
    }
    from_vertex[steps++] = (ends[kForwards] - p) + (ends[kBackwards] - p);
  }
  if (norm(ends[kForwards] - ends[kBackwards]) < kMinExtent * length) return {0.0f, 0.0f, 0.0f};
  // These weights remove teeth whose sides are one step each, and leave a parabola unchanged.
  return 1.0f / 4.0f * from_vertex[0] + -1.0f / 16.0f * from_vertex[1];
}

Vec3f Outline::smoothed(uint32_t vertex, const std::vector<Vec3f>& positions) const {
  const Vec3f& position = positions[vertex - first_];
  if (!hasRim(vertex) || at(vertex).kind == Kind::kFixed) return position;
  if (at(vertex).kind == Kind::kPlain) return position + shiftOf(vertex, positions);
  const uint32_t ends[2] = {beside(vertex, kForwards), beside(vertex, kBackwards)};
  if (ends[0] == kNone || ends[1] == kNone) return position;
  return position + 0.5f * (shiftOf(ends[0], positions) + shiftOf(ends[1], positions));
}

}  // namespace dtsdf
