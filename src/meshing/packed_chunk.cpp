#include "meshing/packed_chunk.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/refine.h"
#include "meshing/mesh_stream.h"
#include "params/text.h"

namespace dtsdf {
namespace {

constexpr int kMostStepsPerVoxel = 512;
/// A block's vertices lie at most so many voxels below it, and as many above (BlockVertex).
constexpr int kVoxelsBeyond = 2;
constexpr int kMostLatticeSteps = 65535;
constexpr size_t kMostVertices16 = 65536;
constexpr float kNormalUnits = 32767.0f;

/// Rounds to the nearest whole number, halves away from zero.
int16_t roundToUnits(float units) {
  const double half = units < 0.0f ? -0.5 : 0.5;
  return static_cast<int16_t>(static_cast<double>(units) + half);
}

float foldSign(float value) { return value < 0.0f ? -1.0f : 1.0f; }

/// Far more than any map has: 2^31 blocks of 8 voxels with 512 steps each. Sums stay exact in a
/// double.
constexpr int64_t kFarthestOrigin = int64_t{1} << 43;

/// A voxel is at most so large.
constexpr double kLongestStep_m = 1.0;

template <class Index>
void checkTriangles(const std::vector<Index>& triangles, size_t vertices) {
  if (triangles.size() % 3 != 0)
    throw std::runtime_error(
        "the number of indices is not a multiple "
        "of 3");
  const auto last = std::max_element(triangles.begin(), triangles.end());
  if (last != triangles.end() && *last >= vertices) {
    throw std::runtime_error("a triangle has vertex " + std::to_string(*last) + " of " +
                             std::to_string(vertices));
  }
}

}  // namespace

ChunkLattice::ChunkLattice(float voxel_size_m, int chunk_blocks)
    : chunk_blocks(chunk_blocks), steps_per_voxel(kMostStepsPerVoxel) {
  const int voxels = chunk_blocks * kBlockSide + 2 * kVoxelsBeyond;
  while (voxels * steps_per_voxel > kMostLatticeSteps) steps_per_voxel /= 2;
  step_m = static_cast<double>(voxel_size_m) / steps_per_voxel;
}

namespace {

/// Positions of the vertices of a chunk, in steps from its origin.
VertexPlaces placesInChunk(const ChunkLattice& lattice, const BlockKey& corner) {
  const Vec3i first = firstVoxelOfBlock(corner);
  // Rounded in its block, where whoever repeats a vertex has the same bits but for whole voxels:
  // the sum with these is exact. In double, in which a position in steps is exact as well.
  const auto stepsOf = [per_voxel = lattice.steps_per_voxel](int voxel, float position) {
    const double steps = std::floor(static_cast<double>(position) * per_voxel + 0.5);
    return static_cast<float>((voxel + kVoxelsBeyond) * per_voxel + steps);
  };
  const auto position = [=](const BlockKey& block, const BlockVertex& vertex) {
    const Vec3i voxel = firstVoxelOfBlock(block) - first;
    const Vec3f& p = vertex.position;
    return Vec3f{stepsOf(voxel.x, p.x), stepsOf(voxel.y, p.y), stepsOf(voxel.z, p.z)};
  };
  // Those on the faces of the chunk stay: outlines go on in chunks beside it.
  const int voxels = lattice.chunk_blocks * kBlockSide;
  const auto kind = [=](const BlockKey& block, const BlockVertex& vertex) {
    if (isMiddle(vertex.edge)) return Outline::Kind::kMiddle;
    const int edge = static_cast<int>(vertex.edge), axis = edgeAxis(edge);
    const Vec3i at = firstVoxelOfBlock(block) - first + cornerAt(edgeCorner(edge));
    const auto isOnFace = [&](int across, int place) {
      return axis != across && (place == 0 || place == voxels);
    };
    const bool is_on_face = isOnFace(0, at.x) || isOnFace(1, at.y) || isOnFace(2, at.z);
    return is_on_face ? Outline::Kind::kFixed : Outline::Kind::kPlain;
  };
  return {{}, position, kind};
}

}  // namespace

PackedChunk packChunk(const MeshStore& mesh, const ChunkLattice& lattice, const BlockKey& corner,
                      const std::vector<PackedKey>& blocks) {
  std::vector<const BlockMesh*> meshes;
  for (const PackedKey key : blocks) {
    const auto it = mesh.blocks().find(key);
    if (it != mesh.blocks().end()) meshes.push_back(it->second.get());
  }
  const Mesh joined = joinBlocks(meshes, placesInChunk(lattice, corner));
  PackedChunk chunk;
  const Vec3i first = firstVoxelOfBlock(corner);
  for (int axis = 0; axis < 3; ++axis) {
    chunk.origin[axis] =
        (int64_t{component(first, axis)} - kVoxelsBeyond) * lattice.steps_per_voxel;
  }
  const bool is_painted = std::any_of(joined.colours.begin(), joined.colours.end(),
                                      [](const VertexColour& c) { return c.painted != 0; });
  const size_t vertices = joined.vertices_m.size();
  chunk.positions.reserve(3 * vertices);
  chunk.normals.reserve(2 * vertices);
  chunk.colours.reserve(is_painted ? 3 * vertices : 0);
  for (size_t i = 0; i < vertices; ++i) {
    // A line may bulge out of the chunk, by less than what vertices have beyond it.
    const Vec3f p = joined.vertices_m[i] + Vec3f{0.5f, 0.5f, 0.5f};
    for (const float steps : {p.x, p.y, p.z})
      chunk.positions.push_back(static_cast<uint16_t>(steps));
    const auto normal = packedNormal(joined.normals[i]);
    chunk.normals.insert(chunk.normals.end(), normal.begin(), normal.end());
    if (!is_painted) continue;
    // What no image has seen gets the colour that it has in files.
    const auto rgb = vertexColour(MeshColour::kImage, joined, i);
    chunk.colours.insert(chunk.colours.end(), rgb.begin(), rgb.end());
  }
  const uint32_t* const corners = joined.triangles.empty() ? nullptr : joined.triangles[0].data();
  const uint32_t* const end = corners + 3 * joined.triangles.size();
  if (vertices <= kMostVertices16) {
    chunk.triangles16.assign(corners, end);
  } else {
    chunk.triangles32.assign(corners, end);
  }
  return chunk;
}

void checkChunk(const PackedChunk& chunk) {
  const size_t vertices = chunk.vertexCount();
  if (chunk.positions.size() != 3 * vertices || chunk.normals.size() != 2 * vertices ||
      (!chunk.colours.empty() && chunk.colours.size() != 3 * vertices)) {
    throw std::runtime_error("positions, normals and colours are of different numbers of vertices");
  }
  if (!chunk.triangles16.empty() && !chunk.triangles32.empty()) {
    throw std::runtime_error("it has triangles with indices of both widths");
  }
  if (!chunk.triangles16.empty() && vertices > kMostVertices16) {
    throw std::runtime_error("it has more vertices than 16-bit indices can address");
  }
  checkTriangles(chunk.triangles16, vertices);
  checkTriangles(chunk.triangles32, vertices);
  for (const int64_t steps : chunk.origin) {
    if (steps < -kFarthestOrigin || steps > kFarthestOrigin) {
      throw std::runtime_error("the origin is out of range");
    }
  }
}

void checkStep(double step_m) {
  if (step_m > 0.0 && step_m <= kLongestStep_m) return;
  throw std::runtime_error("a step of " + shortestText(step_m) +
                           " m is impossible; it must be above 0 and at most 1 m");
}

std::array<double, 3> positionOf(const PackedChunk& chunk, double step_m, size_t vertex) {
  std::array<double, 3> p_W;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t steps = chunk.origin[axis] + chunk.positions[3 * vertex + axis];
    p_W[axis] = static_cast<double>(steps) * step_m;
  }
  return p_W;
}

std::array<int16_t, 2> packedNormal(const Vec3f& normal) {
  const float sum = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
  float u = normal.x / sum, v = normal.y / sum;
  if (normal.z < 0.0f) {
    const float folded = (1.0f - std::abs(v)) * foldSign(u);
    v = (1.0f - std::abs(u)) * foldSign(v);
    u = folded;
  }
  return {roundToUnits(u * kNormalUnits), roundToUnits(v * kNormalUnits)};
}

Vec3f normalOfPacked(int16_t u, int16_t v) {
  Vec3f n{static_cast<float>(u) / kNormalUnits, static_cast<float>(v) / kNormalUnits, 0.0f};
  n.z = 1.0f - std::abs(n.x) - std::abs(n.y);
  if (n.z < 0.0f) {
    const float folded = (1.0f - std::abs(n.y)) * foldSign(n.x);
    n.y = (1.0f - std::abs(n.x)) * foldSign(n.y);
    n.x = folded;
  }
  return (1.0f / norm(n)) * n;
}

Mesh unpackChunk(const PackedChunk& chunk, double step_m) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    mesh.origin_m[axis] = static_cast<double>(chunk.origin[axis]) * step_m;
  }
  const auto step = static_cast<float>(step_m);
  for (size_t i = 0; i < chunk.vertexCount(); ++i) {
    const uint16_t* const p = &chunk.positions[3 * i];
    mesh.vertices_m.push_back({step * p[0], step * p[1], step * p[2]});
    mesh.normals.push_back(normalOfPacked(chunk.normals[2 * i], chunk.normals[2 * i + 1]));
    if (chunk.colours.empty()) continue;
    mesh.colours.push_back(
        {chunk.colours[3 * i], chunk.colours[3 * i + 1], chunk.colours[3 * i + 2], 255});
  }
  for (size_t t = 0; t < chunk.triangleCount(); ++t) {
    mesh.triangles.push_back(
        {chunk.corner(3 * t), chunk.corner(3 * t + 1), chunk.corner(3 * t + 2)});
  }
  return mesh;
}

namespace {

/// The axis that a normal is closest to, and its sign: 2 axis + (1 if negative).
int facedWayOf(const Vec3f& normal) {
  const float x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  if (x >= y && x >= z) return normal.x < 0.0f ? 1 : 0;
  if (y >= z) return normal.y < 0.0f ? 3 : 2;
  return normal.z < 0.0f ? 5 : 4;
}

}  // namespace

PackedChunk coarsen(const PackedChunk& chunk, int cell_log2) {
  const int64_t size = int64_t{1} << cell_log2;
  PackedChunk coarse;
  coarse.origin = chunk.origin;
  std::unordered_map<uint64_t, uint32_t> vertex_of_cell;
  std::vector<uint32_t> number(chunk.vertexCount());
  for (size_t i = 0; i < number.size(); ++i) {
    const int way = facedWayOf(normalOfPacked(chunk.normals[2 * i], chunk.normals[2 * i + 1]));
    uint64_t key = static_cast<uint64_t>(way);
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t origin = chunk.origin[axis];
      const int64_t cell = (origin + chunk.positions[3 * i + axis]) >> cell_log2;
      key = key << 17 | static_cast<uint64_t>(cell - (origin >> cell_log2));
    }
    const auto next = static_cast<uint32_t>(coarse.vertexCount());
    const auto [known, is_new] = vertex_of_cell.emplace(key, next);
    number[i] = known->second;
    if (!is_new) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t origin = chunk.origin[axis];
      const int64_t cell = (origin + chunk.positions[3 * i + axis]) >> cell_log2;
      int64_t middle = cell * size + size / 2 - origin;
      if (way / 2 == axis) middle += way % 2 == 0 ? size / 4 : -size / 4;
      coarse.positions.push_back(static_cast<uint16_t>(std::clamp<int64_t>(middle, 0, 65535)));
    }
    coarse.normals.insert(coarse.normals.end(), &chunk.normals[2 * i], &chunk.normals[2 * i] + 2);
    if (chunk.colours.empty()) continue;
    coarse.colours.insert(coarse.colours.end(), &chunk.colours[3 * i], &chunk.colours[3 * i] + 3);
  }
  for (size_t t = 0; t < chunk.triangleCount(); ++t) {
    const uint32_t a = number[chunk.corner(3 * t)], b = number[chunk.corner(3 * t + 1)],
                   c = number[chunk.corner(3 * t + 2)];
    if (a == b || b == c || c == a) continue;
    // There are never more vertices than in the chunk: indices are as wide as there.
    for (const uint32_t vertex : {a, b, c}) {
      if (chunk.triangles32.empty()) {
        coarse.triangles16.push_back(static_cast<uint16_t>(vertex));
      } else {
        coarse.triangles32.push_back(vertex);
      }
    }
  }
  return coarse;
}

}  // namespace dtsdf
