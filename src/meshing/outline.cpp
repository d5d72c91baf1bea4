#include "meshing/outline.h"

#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

constexpr int kStepsAlong = 2;

/// Weights of the vertices so many steps away, by how far the line goes on both ways. They take
/// teeth away whose sides are one step each, and leave a parabola as it is where the line goes on.
constexpr float kWeightsAlong[kStepsAlong + 1][kStepsAlong + 1] = {
    {0.0f, 0.0f, 0.0f},
    {0.0f, 1.0f / 4.0f, 0.0f},
    {0.0f, 1.0f / 4.0f, -1.0f / 16.0f},
};

/// A line whose ends are nearer to each other than this share of its length goes back: it is the
/// end of something narrow, which would become shorter.
constexpr float kLeastExtent = 0.4f;

}  // namespace

void Outline::reserve(size_t vertices) {
  sums_.reserve(vertices);
  squares_.reserve(vertices);
  kinds_.reserve(vertices);
}

void Outline::addTriangle(const std::array<uint32_t, 3>& triangle) {
  for (int k = 0; k < 3; ++k) {
    const int64_t at = triangle[k];
    const int64_t after = triangle[(k + 1) % 3] - at, before = triangle[(k + 2) % 3] - at;
    sums_[triangle[k]] += static_cast<uint32_t>(after - before);
    squares_[triangle[k]] += static_cast<uint64_t>(after * after - before * before);
  }
}

void Outline::drop(size_t count) {
  const auto dropFrom = [count](auto& values) {
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
  };
  dropFrom(sums_);
  dropFrom(squares_);
  dropFrom(kinds_);
}

/// By the sums of the triangles around a vertex; kNone: they are no fan, or a closed one.
size_t Outline::endOfFan(size_t vertex, Way way) const {
  const int64_t sum = static_cast<int32_t>(sums_[vertex]);
  const auto squares = static_cast<int64_t>(squares_[vertex]);
  if (sum == 0 || squares % sum != 0) return kNone;
  const int64_t twice = squares / sum + (way == kForwards ? sum : -sum);
  const int64_t number = static_cast<int64_t>(vertex) + twice / 2;
  const bool is_one = twice % 2 == 0 && number >= 0 && number < static_cast<int64_t>(sums_.size());
  return is_one ? static_cast<size_t>(number) : kNone;
}

/// The next vertex on the outline; kNone: the line ends there, or meets another one.
size_t Outline::beside(size_t vertex, Way way) const {
  if (kinds_[vertex] == Kind::kFixed) return kNone;
  const size_t next = endOfFan(vertex, way);
  if (next == kNone || kinds_[next] == Kind::kFixed) return next;
  return endOfFan(next, way == kForwards ? kBackwards : kForwards) == vertex ? next : kNone;
}

/// The same, past the middle of a side.
size_t Outline::nextOnEdge(size_t vertex, Way way) const {
  const size_t next = beside(vertex, way);
  return next != kNone && kinds_[next] == Kind::kMiddle ? beside(next, way) : next;
}

Vec3f Outline::shiftOf(size_t vertex, const std::vector<Vec3f>& positions) const {
  const Vec3f& p = positions[vertex];
  Vec3f ends[2] = {p, p};
  size_t at[2] = {vertex, vertex};
  Vec3f from_vertex[kStepsAlong + 1];  // both ways together
  float length = 0.0f;
  int steps = 0;
  while (steps < kStepsAlong) {
    for (const Way way : {kForwards, kBackwards}) at[way] = nextOnEdge(at[way], way);
    if (at[kForwards] == kNone || at[kBackwards] == kNone) break;
    for (const Way way : {kForwards, kBackwards}) {
      length += norm(positions[at[way]] - ends[way]);
      ends[way] = positions[at[way]];
    }
    from_vertex[++steps] = (ends[kForwards] - p) + (ends[kBackwards] - p);
  }
  Vec3f shift{0.0f, 0.0f, 0.0f};
  if (norm(ends[kForwards] - ends[kBackwards]) < kLeastExtent * length) return shift;
  for (int k = 1; k <= steps; ++k) shift = shift + kWeightsAlong[steps][k] * from_vertex[k];
  return shift;
}

Vec3f Outline::smoothed(size_t vertex, const std::vector<Vec3f>& positions) const {
  const Vec3f& position = positions[vertex];
  if (isInside(vertex) || kinds_[vertex] == Kind::kFixed) return position;
  if (kinds_[vertex] == Kind::kPlain) return position + shiftOf(vertex, positions);
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
