#include "meshing/outline.h"

#include <limits>

#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

constexpr int kStepsAlong = 2;

/// Weights by [steps that the line continues both ways][steps to the neighbour]. They remove teeth
/// whose sides are one step each; where the line continues, they leave a parabola unchanged.
constexpr float kWeightsAlong[kStepsAlong + 1][kStepsAlong + 1] = {
    {0.0f, 0.0f, 0.0f},
    {0.0f, 1.0f / 4.0f, 0.0f},
    {0.0f, 1.0f / 4.0f, -1.0f / 16.0f},
};

/// A line whose ends are closer together than this share of its length turns back: it is the tip of
/// something narrow, which smoothing would shorten.
constexpr float kMinExtent = 0.4f;

/// Holes with more edges, which are over two voxels across, stay open.
constexpr int kMaxEdgesOfHole = 8;

}  // namespace

void Outline::addTriangle(const Triangle& triangle) {
  for (int k = 0; k < 3; ++k) {
    const int64_t at = triangle[k];
    const int64_t after = triangle[(k + 1) % 3] - at, before = triangle[(k + 2) % 3] - at;
    Vertex& vertex = vertices_[triangle[k]];
    vertex.sum += static_cast<uint32_t>(after - before);
    vertex.squares += static_cast<uint64_t>(after * after - before * before);
    vertex.triangles = vertex.triangles == 0 ? 1 : 2;
    vertex.has_ends = false;
  }
}

void Outline::drop(size_t count) {
  vertices_.erase(vertices_.begin(), vertices_.begin() + static_cast<std::ptrdiff_t>(count));
}

/// Computes the ends of the fan around a vertex from the vertex's sums.
void Outline::findEnds(size_t vertex) const {
  Vertex& v = vertices_[vertex];
  v.has_ends = true;
  v.ends[kForwards] = v.ends[kBackwards] = 0;
  const int64_t sum = static_cast<int32_t>(v.sum);
  const auto squares = static_cast<int64_t>(v.squares);
  if (sum == 0 || squares % sum != 0 || (squares / sum + sum) % 2 != 0) return;
  const int64_t forwards = (squares / sum + sum) / 2, backwards = (squares / sum - sum) / 2;
  const auto isOne = [&](int64_t end) {
    const int64_t number = static_cast<int64_t>(vertex) + end;
    return number >= 0 && number < static_cast<int64_t>(vertices_.size());
  };
  if (isOne(forwards)) v.ends[kForwards] = static_cast<int32_t>(forwards);
  if (isOne(backwards)) v.ends[kBackwards] = static_cast<int32_t>(backwards);
}

/// One end of the fan of triangles around a vertex; kNone: not a fan, or a closed one.
size_t Outline::endOfFan(size_t vertex, int way) const {
  if (!vertices_[vertex].has_ends) findEnds(vertex);
  const int32_t end = vertices_[vertex].ends[way];
  const int64_t number = static_cast<int64_t>(vertex) + end;
  // The sums of two fans may give the number of a vertex that was dropped since.
  return end == 0 || number < 0 ? kNone : static_cast<size_t>(number);
}

/// The next vertex on the outline; kNone: the outline ends there, or meets another one.
size_t Outline::beside(size_t vertex, int way) const {
  if (kindOf(vertex) == Kind::kFixed) return kNone;
  const size_t next = endOfFan(vertex, way);
  if (next == kNone || kindOf(next) == Kind::kFixed) return next;
  return endOfFan(next, way == kForwards ? kBackwards : kForwards) == vertex ? next : kNone;
}

/// The next vertex on the outline that is not the midpoint of a side.
size_t Outline::nextOnEdge(size_t vertex, int way) const {
  const size_t next = beside(vertex, way);
  return next != kNone && kindOf(next) == Kind::kMiddle ? beside(next, way) : next;
}

/// The vertices of a short outline, in counter-clockwise order for triangles inside it. None if the
/// outline is longer, or if `lowest` is not its lowest vertex.
void Outline::followLoop(size_t lowest, std::vector<uint32_t>& loop) const {
  loop.clear();
  int edges = 0;
  size_t at = lowest;
  do {
    const Vertex& vertex = vertices_[at];
    edges += vertex.kind == Kind::kPlain ? 1 : 0;
    loop.push_back(static_cast<uint32_t>(at));
    at = vertex.triangles < 2 || edges > kMaxEdgesOfHole ? kNone : beside(at, kBackwards);
  } while (at != kNone && at > lowest);
  if (at != lowest) loop.clear();
}

/// Cuts one corner off a loop: of those whose triangle faces the same way as the surface, the one
/// whose neighbours are closest to each other. @return whether there was one.
bool Outline::cutCorner(std::vector<uint32_t>& loop, const std::vector<Vec3f>& positions,
                        const std::vector<Vec3f>& normals, std::vector<Triangle>& triangles) const {
  const size_t count = loop.size();
  size_t best = count;
  float shortest = std::numeric_limits<float>::infinity();
  Triangle triangle{};
  for (size_t i = 0; i < count; ++i) {
    const Triangle t{loop[(i + count - 1) % count], loop[i], loop[(i + 1) % count]};
    const Vec3f& p = positions[t[0]];
    const Vec3f across = positions[t[2]] - p;
    const bool faces = dot(cross(positions[t[1]] - p, across), normals[t[1]]) > 0.0f;
    if (!faces || norm(across) >= shortest) continue;
    shortest = norm(across);
    best = i;
    triangle = t;
  }
  if (best == count) return false;
  triangles.push_back(triangle);
  loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(best));
  return true;
}

void Outline::closeHoles(size_t first, size_t end, const std::vector<Vec3f>& positions,
                         const std::vector<Vec3f>& normals,
                         const std::function<void(const Triangle&)>& add) {
  std::vector<uint32_t> loop;
  std::vector<Triangle> triangles;
  for (size_t i = first; i < end; ++i) {
    if (isInside(i)) continue;
    followLoop(i, loop);
    triangles.clear();
    while (loop.size() >= 3 && cutCorner(loop, positions, normals, triangles)) continue;
    if (loop.size() >= 3) continue;
    for (const Triangle& triangle : triangles) {
      addTriangle(triangle);
      add(triangle);
    }
  }
}

Vec3f Outline::shiftOf(size_t vertex, const std::vector<Vec3f>& positions) const {
  const Vec3f& p = positions[vertex];
  Vec3f ends[2] = {p, p};
  size_t at[2] = {vertex, vertex};
  Vec3f from_vertex[kStepsAlong + 1];  // sum over both ways
  float length = 0.0f;
  int steps = 0;
  while (steps < kStepsAlong) {
    for (const int way : {kForwards, kBackwards}) at[way] = nextOnEdge(at[way], way);
    if (at[kForwards] == kNone || at[kBackwards] == kNone) break;
    for (const int way : {kForwards, kBackwards}) {
      length += norm(positions[at[way]] - ends[way]);
      ends[way] = positions[at[way]];
    }
    from_vertex[++steps] = (ends[kForwards] - p) + (ends[kBackwards] - p);
  }
  Vec3f shift{0.0f, 0.0f, 0.0f};
  if (norm(ends[kForwards] - ends[kBackwards]) < kMinExtent * length) return shift;
  for (int k = 1; k <= steps; ++k) shift = shift + kWeightsAlong[steps][k] * from_vertex[k];
  return shift;
}

Vec3f Outline::smoothed(size_t vertex, const std::vector<Vec3f>& positions) const {
  const Vec3f& position = positions[vertex];
  if (isInside(vertex) || kindOf(vertex) == Kind::kFixed) return position;
  if (kindOf(vertex) == Kind::kPlain) return position + shiftOf(vertex, positions);
  const size_t ends[2] = {beside(vertex, kForwards), beside(vertex, kBackwards)};
  if (ends[0] == kNone || ends[1] == kNone) return position;
  return position + 0.5f * (shiftOf(ends[0], positions) + shiftOf(ends[1], positions));
}

std::vector<std::pair<size_t, Vec3f>> Outline::smoothed(const std::vector<Vec3f>& positions) const {
  std::vector<std::pair<size_t, Vec3f>> moved;
  for (size_t i = 0; i < positions.size(); ++i) {
    if (!isInside(i)) moved.emplace_back(i, smoothed(i, positions));
  }
  return moved;
}

}  // namespace dtsdf
