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
#include "threads/parallel.h"

namespace dtsdf {
namespace {

constexpr int kMaxStepsPerVoxel = 512;
/// A block's vertices lie at most this many voxels outside it along each axis (see BlockVertex).
constexpr int kVoxelsBeyond = 2;
constexpr int kMaxLatticeSteps = 65535;
constexpr size_t kMaxVertices16 = 65536;
constexpr float kNormalUnits = 32767.0f;

/// Rounds to the nearest whole number, halves away from zero. Adds the float below a half, since
/// adding a half would round it up to 1.
int16_t roundToUnits(float units) {
  constexpr float kBelowHalf = 0.49999997f;
  return static_cast<int16_t>(static_cast<int>(units + std::copysign(kBelowHalf, units)));
}

/// The faces of a cube that a place lies on: bits 2 * axis for coordinate 0, and 2 * axis + 1 for
/// coordinate `last`.
int facesAt(const Vec3i& place, int last) {
  const auto bits = [last](int at) { return (at == 0 ? 1 : 0) | (at == last ? 2 : 0); };
  return bits(place.x) | bits(place.y) << 2 | bits(place.z) << 4;
}

/// The faces of a block's grid that contain each edge, for both facings.
std::array<int8_t, kGridEdges / 2> facesOfEdges() {
  std::array<int8_t, kGridEdges / 2> faces;
  for (int n = 0; n < kGridEdges / 2; ++n) {
    faces[n] = static_cast<int8_t>(facesAt(cornerAt(n / 3), kBlockSide) & ~(3 << n % 3 * 2));
  }
  return faces;
}

/// Joins the blocks of a chunk.
class ChunkPacker {
 public:
  ChunkPacker(const ChunkLattice& lattice, const BlockKey& corner)
      : steps_per_voxel_(lattice.steps_per_voxel),
        voxels_(lattice.chunk_blocks * kBlockSide),
        corner_(firstVoxelOfBlock(corner)) {
    const std::array<int, 3> first{corner_.x, corner_.y, corner_.z};
    for (int axis = 0; axis < 3; ++axis) {
      chunk_.origin[axis] = (static_cast<int64_t>(first[axis]) - kVoxelsBeyond) * steps_per_voxel_;
    }
  }

  /// Reserves memory for all blocks, so that adding them never reallocates.
  void reserve(size_t vertices, size_t triangles) {
    mesh_.vertices_m.reserve(vertices);
    mesh_.normals.reserve(vertices);
    mesh_.colours.reserve(vertices);
    mesh_.triangles.reserve(triangles);
    outline_.reserve(vertices);
  }

  void add(const BlockMesh& block) {
    const JoinedBlock& joined = joiner_.add(block);
    const Vec3i voxel = firstVoxelOfBlock(block.key) - corner_;
    const int faces = facesAt(voxel, voxels_ - kBlockSide);
    for (const uint32_t i : joined.fresh) {
      const Vec3f& p = block.vertices[i].position;
      mesh_.vertices_m.push_back(
          {stepsOf(voxel.x, p.x), stepsOf(voxel.y, p.y), stepsOf(voxel.z, p.z)});
      mesh_.colours.push_back(block.colours.empty() ? VertexColour{} : block.colours[i]);
      outline_.addVertex(kindOf(block.vertices[i].edge, faces));
    }
    mesh_.normals.resize(mesh_.vertices_m.size());
    for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
      const uint16_t* const corner = &block.triangles[t];
      mesh_.triangles.push_back(
          {joined.number[corner[0]], joined.number[corner[1]], joined.number[corner[2]]});
      addNormal(block, joined, corner, mesh_.triangles.back(), mesh_.normals);
      outline_.addTriangle(mesh_.triangles.back());
    }
  }

  PackedChunk finish() {
    mendMesh(mesh_, outline_, static_cast<float>(steps_per_voxel_));
    makeUnit(mesh_.normals);
    const size_t count = mesh_.vertices_m.size();
    chunk_.positions.resize(3 * count);
    chunk_.normals.resize(2 * count);
    uint16_t* position = chunk_.positions.data();
    int16_t* normal = chunk_.normals.data();
    for (size_t i = 0; i < count; ++i) {
      // A smoothed outline may bulge out of the chunk, but by less than kVoxelsBeyond.
      const Vec3f& steps = mesh_.vertices_m[i];
      for (const float s : {steps.x, steps.y, steps.z})
        *position++ = static_cast<uint16_t>(s + 0.5f);
      for (const int16_t component : packedNormal(mesh_.normals[i])) *normal++ = component;
    }
    addColours();
    const auto addTriangles = [this](auto& indices) {
      indices.resize(3 * mesh_.triangles.size());
      auto* index = indices.data();
      for (const auto& triangle : mesh_.triangles) {
        for (const uint32_t v : triangle) *index++ = static_cast<std::decay_t<decltype(*index)>>(v);
      }
    };
    if (count <= kMaxVertices16) {
      addTriangles(chunk_.triangles16);
    } else {
      addTriangles(chunk_.triangles32);
    }
    return std::move(chunk_);
  }

 private:
  /// Rounds before adding the block's position, so that all blocks that share a vertex give the
  /// same result: relative to these blocks, its positions differ by whole voxels, and a voxel is a
  /// whole number of steps. Adding kVoxelsBeyond makes the position positive.
  float stepsOf(int voxel, float position) const {
    const double steps = (static_cast<double>(position) + kVoxelsBeyond) * steps_per_voxel_;
    return static_cast<float>(voxel * steps_per_voxel_ + static_cast<int>(steps + 0.5));
  }

  /// Vertices on the chunk's faces stay in place, since outlines continue in neighbouring chunks.
  /// @param faces The faces of the block that lie on faces of the chunk (see facesAt()).
  static Outline::Kind kindOf(uint32_t edge, int faces) {
    static const std::array<int8_t, kGridEdges / 2> faces_of_edges = facesOfEdges();
    if (isMidpoint(edge)) return Outline::Kind::kMiddle;
    return (faces_of_edges[edge / 2] & faces) != 0 ? Outline::Kind::kFixed : Outline::Kind::kPlain;
  }

  /// Unpainted vertices get the same colour as in mesh files.
  void addColours() {
    const auto is_painted = [](const VertexColour& colour) { return colour.painted != 0; };
    if (std::none_of(mesh_.colours.begin(), mesh_.colours.end(), is_painted)) return;
    for (size_t i = 0; i < mesh_.colours.size(); ++i) {
      const std::array<uint8_t, 3> rgb = vertexColour(MeshColour::kImage, mesh_, i);
      chunk_.colours.insert(chunk_.colours.end(), rgb.begin(), rgb.end());
    }
  }

  int steps_per_voxel_;
  int voxels_;    ///< Voxels along an edge of the chunk.
  Vec3i corner_;  ///< First voxel of the chunk.
  PackedChunk chunk_;
  BlockJoiner joiner_;
  Outline outline_;
  Mesh mesh_;  ///< Its vertices are in steps from the chunk's origin.
};

float foldSign(float value) { return value < 0.0f ? -1.0f : 1.0f; }

/// Far beyond any map: 2^31 blocks of 8 voxels with 512 steps each. Sums stay exact in a double.
constexpr int64_t kFarthestOrigin = int64_t{1} << 43;

/// The largest voxel size, and therefore the longest step.
constexpr double kLongestStep_m = 1.0;

template <class Index>
void checkTriangles(const std::vector<Index>& triangles, size_t vertices) {
  if (triangles.size() % 3 != 0)
    throw std::runtime_error("the number of indices is not a multiple of 3");
  const auto last = std::max_element(triangles.begin(), triangles.end());
  if (last != triangles.end() && *last >= vertices) {
    throw std::runtime_error("a triangle uses vertex " + std::to_string(*last) +
                             ", but there are only " + std::to_string(vertices));
  }
}

}  // namespace

ChunkLattice::ChunkLattice(float voxel_size_m, int chunk_blocks)
    : chunk_blocks(chunk_blocks), steps_per_voxel(kMaxStepsPerVoxel) {
  const int voxels = chunk_blocks * kBlockSide + 2 * kVoxelsBeyond;
  while (voxels * steps_per_voxel > kMaxLatticeSteps) steps_per_voxel /= 2;
  step_m = static_cast<double>(voxel_size_m) / steps_per_voxel;
}

PackedChunk packChunk(const MeshStore& mesh, const ChunkLattice& lattice, const BlockKey& corner,
                      const std::vector<PackedKey>& blocks) {
  std::vector<const BlockMesh*> meshes;
  size_t vertices = 0, triangles = 0;
  auto it = mesh.blocks().begin();
  for (const PackedKey key : blocks) {
    if (it != mesh.blocks().end() && it->first < key) it = mesh.blocks().lower_bound(key);
    if (it == mesh.blocks().end() || it->first != key) continue;
    meshes.push_back(it->second.get());
    vertices += it->second->vertices.size();
    triangles += it->second->triangles.size() / 3;
    ++it;
  }
  ChunkPacker packer(lattice, corner);
  packer.reserve(vertices, triangles);
  for (const BlockMesh* block : meshes) packer.add(*block);
  return packer.finish();
}

std::vector<PackedChunk> packChunks(const MeshStore& mesh, const ChunkLattice& lattice,
                                    const MeshChunks& chunks, const std::vector<PackedKey>& keys,
                                    int threads) {
  std::vector<PackedChunk> packed(keys.size());
  parallelFor(keys.size(), threads, [&](size_t i) {
    packed[i] = packChunk(mesh, lattice, chunks.cornerOf(keys[i]), chunks.blocksOf(keys[i]));
  });
  return packed;
}

void checkChunk(const PackedChunk& chunk) {
  const size_t vertices = chunk.vertexCount();
  if (chunk.positions.size() != 3 * vertices || chunk.normals.size() != 2 * vertices ||
      (!chunk.colours.empty() && chunk.colours.size() != 3 * vertices)) {
    throw std::runtime_error("positions, normals and colours differ in their number of vertices");
  }
  if (!chunk.triangles16.empty() && !chunk.triangles32.empty()) {
    throw std::runtime_error("it has both 16-bit and 32-bit triangle indices");
  }
  if (!chunk.triangles16.empty() && vertices > kMaxVertices16) {
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
  const float u = normal.x / sum, v = normal.y / sum;
  const float folded_u = (1.0f - std::abs(v)) * foldSign(u);
  const float folded_v = (1.0f - std::abs(u)) * foldSign(v);
  const bool is_low = normal.z < 0.0f;
  return {roundToUnits((is_low ? folded_u : u) * kNormalUnits),
          roundToUnits((is_low ? folded_v : v) * kNormalUnits)};
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

/// The signed axis that a normal is closest to, as 2 * axis + (1 if negative).
int facedDirectionOf(const Vec3f& normal) {
  const float x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  if (x >= y && x >= z) return normal.x < 0.0f ? 1 : 0;
  if (y >= z) return normal.y < 0.0f ? 3 : 2;
  return normal.z < 0.0f ? 5 : 4;
}

}  // namespace

PackedChunk coarsen(const PackedChunk& chunk, int cell_log2) {
  PackedChunk coarse;
  for (int axis = 0; axis < 3; ++axis) coarse.origin[axis] = (chunk.origin[axis] >> cell_log2) * 4;
  std::unordered_map<uint64_t, uint32_t> vertex_of_cell;
  std::vector<uint32_t> number(chunk.vertexCount());
  for (size_t i = 0; i < number.size(); ++i) {
    const int way =
        facedDirectionOf(normalOfPacked(chunk.normals[2 * i], chunk.normals[2 * i + 1]));
    uint64_t key = static_cast<uint64_t>(way);
    std::array<uint16_t, 3> quarters;
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t place = chunk.origin[axis] + chunk.positions[3 * i + axis];
      const int64_t first = (place >> cell_log2) * 4 - coarse.origin[axis];
      const int shift = way / 2 != axis ? 0 : way % 2 == 0 ? 1 : -1;
      key = key << 17 | static_cast<uint64_t>(first);
      quarters[axis] = static_cast<uint16_t>(first + 2 + shift);
    }
    const auto next = static_cast<uint32_t>(coarse.vertexCount());
    const auto [known, is_new] = vertex_of_cell.emplace(key, next);
    number[i] = known->second;
    if (!is_new) continue;
    coarse.positions.insert(coarse.positions.end(), quarters.begin(), quarters.end());
    coarse.normals.insert(coarse.normals.end(), &chunk.normals[2 * i], &chunk.normals[2 * i] + 2);
    if (chunk.colours.empty()) continue;
    coarse.colours.insert(coarse.colours.end(), &chunk.colours[3 * i], &chunk.colours[3 * i] + 3);
  }
  for (size_t t = 0; t < chunk.triangleCount(); ++t) {
    const uint32_t a = number[chunk.corner(3 * t)], b = number[chunk.corner(3 * t + 1)],
                   c = number[chunk.corner(3 * t + 2)];
    if (a == b || b == c || c == a) continue;
    // Coarsening adds no vertices, so the indices keep their width.
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
