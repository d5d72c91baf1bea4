#include "meshing/coarse_chunk.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace dtsdf {
namespace {

/// The axis that a normal is closest to, and its sign: 2 axis + (1 if negative).
int facedWayOf(const Vec3f& normal) {
  const float x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  if (x >= y && x >= z) return normal.x < 0.0f ? 1 : 0;
  if (y >= z) return normal.y < 0.0f ? 3 : 2;
  return normal.z < 0.0f ? 5 : 4;
}

class Coarsener {
 public:
  Coarsener(const PackedChunk& chunk, int cell_log2) : chunk_(chunk), cell_log2_(cell_log2) {
    coarse_.origin = chunk.origin;
  }

  PackedChunk run() {
    std::vector<uint32_t> number(chunk_.vertexCount());
    for (size_t i = 0; i < number.size(); ++i) number[i] = numberOf(i);
    for (size_t t = 0; t < chunk_.triangleCount(); ++t) {
      const uint32_t a = number[chunk_.corner(3 * t)], b = number[chunk_.corner(3 * t + 1)],
                     c = number[chunk_.corner(3 * t + 2)];
      if (a != b && b != c && c != a) add({a, b, c});
    }
    return std::move(coarse_);
  }

 private:
  /// There are never more vertices than in the chunk, which checkChunk() has looked at: indices are
  /// as wide as there.
  void add(const std::array<uint32_t, 3>& triangle) {
    for (const uint32_t vertex : triangle) {
      if (chunk_.triangles32.empty()) {
        coarse_.triangles16.push_back(static_cast<uint16_t>(vertex));
      } else {
        coarse_.triangles32.push_back(vertex);
      }
    }
  }

  uint32_t numberOf(size_t i) {
    const int way = facedWayOf(unpackNormal(chunk_.normals[2 * i], chunk_.normals[2 * i + 1]));
    uint64_t key = static_cast<uint64_t>(way);
    std::array<uint16_t, 3> middle;
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t cell = (chunk_.origin[axis] + chunk_.positions[3 * i + axis]) >> cell_log2_;
      const int64_t first = chunk_.origin[axis] >> cell_log2_;
      key = key << 17 | static_cast<uint64_t>(cell - first);
      middle[axis] = middleOf(axis, cell, way);
    }
    const auto next = static_cast<uint32_t>(coarse_.vertexCount());
    const auto [entry, is_new] = numbers_.emplace(key, next);
    if (is_new) addVertex(i, middle);
    return entry->second;
  }

  uint16_t middleOf(int axis, int64_t cell, int way) const {
    const int64_t size = int64_t{1} << cell_log2_;
    int64_t middle = cell * size + size / 2 - chunk_.origin[axis];
    if (way / 2 == axis) middle += way % 2 == 0 ? size / 4 : -size / 4;
    return static_cast<uint16_t>(std::clamp<int64_t>(middle, 0, 65535));
  }

  void addVertex(size_t i, const std::array<uint16_t, 3>& position) {
    coarse_.positions.insert(coarse_.positions.end(), position.begin(), position.end());
    coarse_.normals.push_back(chunk_.normals[2 * i]);
    coarse_.normals.push_back(chunk_.normals[2 * i + 1]);
    if (chunk_.colours.empty()) return;
    const auto colour = chunk_.colours.begin() + static_cast<std::ptrdiff_t>(3 * i);
    coarse_.colours.insert(coarse_.colours.end(), colour, colour + 3);
  }

  const PackedChunk& chunk_;
  int cell_log2_;
  PackedChunk coarse_;
  std::unordered_map<uint64_t, uint32_t> numbers_;
};

}  // namespace

PackedChunk coarsen(const PackedChunk& chunk, int cell_log2) {
  return Coarsener(chunk, cell_log2).run();
}

}  // namespace dtsdf
