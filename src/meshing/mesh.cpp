#include "dtsdf_mapping/mesh.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/refine.h"

namespace dtsdf {
namespace {

/// An edge of the whole grid: the block that owns it and the edge's number in there.
struct GlobalEdge {
  PackedKey block;
  uint32_t edge;
  bool operator==(const GlobalEdge& other) const {
    return block == other.block && edge == other.edge;
  }
};

struct GlobalEdgeHash {
  size_t operator()(const GlobalEdge& e) const {
    return static_cast<size_t>(hashKey(e.block * kGridEdges + e.edge));
  }
};

/// The owner of an edge is the block of its lower corner: corners on a far face of the corner grid
/// belong to the neighbour.
GlobalEdge ownerOf(const BlockKey& key, uint32_t edge) {
  const Vec3i corner = cornerAt(edgeCorner(static_cast<int>(edge)));
  const Vec3i step{corner.x >> kBlockSideLog2, corner.y >> kBlockSideLog2,
                   corner.z >> kBlockSideLog2};
  constexpr int kMask = kBlockSide - 1;
  const int own = edgeNumber(cornerIndex(corner.x & kMask, corner.y & kMask, corner.z & kMask),
                              edgeAxis(static_cast<int>(edge)), edgeFacing(static_cast<int>(edge)));
  return {packKey(key + step), static_cast<uint32_t>(own)};
}

/// The middle of a side: the numbers of its two ends in the whole mesh, the lower one first.
struct GlobalSide {
  uint32_t first, second;
  bool operator==(const GlobalSide& other) const {
    return first == other.first && second == other.second;
  }
};

struct GlobalSideHash {
  size_t operator()(const GlobalSide& s) const {
    return static_cast<size_t>(hashKey(uint64_t{s.first} << 32 | s.second));
  }
};

/// Joins block meshes; the order of the blocks decides the order of everything.
class Assembler {
 public:
  explicit Assembler(const MeshStore& store) : store_(store) {}

  void add(const BlockMesh& block) {
    std::vector<uint32_t> number(block.vertices.size());
    for (size_t i = 0; i < block.vertices.size(); ++i) {
      const BlockVertex& vertex = block.vertices[i];
      const auto next = static_cast<uint32_t>(mesh_.vertices_m.size());
      number[i] = isMiddle(vertex.edge)
                      ? sides_.emplace(sideOf(vertex.edge), next).first->second
                      : index_.emplace(ownerOf(block.key, vertex.edge), next).first->second;
      if (number[i] == next) addVertex(block, i);
      if (!isMiddle(vertex.edge)) number_of_edge_[vertex.edge] = number[i];
    }
    for (size_t t = 0; t + 2 < block.triangles.size(); t += 3) {
      mesh_.triangles.push_back({number[block.triangles[t]], number[block.triangles[t + 1]],
                                 number[block.triangles[t + 2]]});
    }
  }

  Mesh finish() {
    if (!mesh_.colours.empty()) mesh_.colours.resize(mesh_.vertices_m.size());
    computeNormals();
    return std::move(mesh_);
  }

 private:
  /// Of a middle in the block that is being added, both of whose ends are known by now.
  GlobalSide sideOf(uint32_t middle) const {
    const auto [first, second] = std::minmax(number_of_edge_[middleFirst(middle)],
                                             number_of_edge_[middleSecond(middle)]);
    return {first, second};
  }

  /// Blocks that were meshed before the map was first painted have no colours.
  void addVertex(const BlockMesh& block, size_t i) {
    mesh_.vertices_m.push_back(store_.positionInMap(block.key, block.vertices[i]));
    faced_ways_.push_back(facedWays(block.vertices[i].edge));
    if (block.colours.empty()) return;
    mesh_.colours.resize(mesh_.vertices_m.size() - 1);
    mesh_.colours.push_back(block.colours[i]);
  }

  /// Area-weighted mean of the normals of the triangles around each vertex. At the rim of what was
  /// seen anchoring may fold a triangle: it faces against what its edges face, which no triangle
  /// does whose vertices are on their edges. Its normal counts turned round.
  void computeNormals() {
    mesh_.normals.assign(mesh_.vertices_m.size(), Vec3f{0.0f, 0.0f, 0.0f});
    for (const auto& t : mesh_.triangles) {
      const Vec3f a = mesh_.vertices_m[t[1]] - mesh_.vertices_m[t[0]];
      const Vec3f b = mesh_.vertices_m[t[2]] - mesh_.vertices_m[t[0]];
      const Vec3f n = cross(a, b);
      const Vec3f faced = toFloat(faced_ways_[t[0]] + faced_ways_[t[1]] + faced_ways_[t[2]]);
      const float turn = dot(n, faced) < 0.0f ? -1.0f : 1.0f;
      for (const uint32_t v : t) mesh_.normals[v] = mesh_.normals[v] + turn * n;
    }
    for (Vec3f& n : mesh_.normals) {
      const float length = norm(n);
      n = length > 0.0f ? (1.0f / length) * n : Vec3f{0.0f, 0.0f, 1.0f};
    }
  }

  const MeshStore& store_;
  Mesh mesh_;
  std::vector<Vec3i> faced_ways_;  ///< Of each vertex.
  std::unordered_map<GlobalEdge, uint32_t, GlobalEdgeHash> index_;
  std::unordered_map<GlobalSide, uint32_t, GlobalSideHash> sides_;
  /// Of those in the block that is being added.
  std::array<uint32_t, kGridEdges> number_of_edge_ = {};
};

uint8_t toByte(float share) {
  return static_cast<uint8_t>(std::lround(255.0f * std::min(std::max(share, 0.0f), 1.0f)));
}

/// Fully saturated colour of a hue in [0, 1).
std::array<uint8_t, 3> hueToRgb(float hue) {
  const auto ramp = [hue](float shift) {
    const float h = hue + shift - std::floor(hue + shift);
    return toByte(std::abs(6.0f * h - 3.0f) - 1.0f);
  };
  return {ramp(0.0f), ramp(2.0f / 3.0f), ramp(1.0f / 3.0f)};
}

std::array<uint8_t, 3> normalColour(const Vec3f& normal_W) {
  return {toByte(0.5f + 0.5f * normal_W.x), toByte(0.5f + 0.5f * normal_W.y),
          toByte(0.5f + 0.5f * normal_W.z)};
}

std::array<uint8_t, 3> heightColour(float z_m) {
  constexpr float kRainbowPeriod_m = 3.0f;
  const float turns = z_m / kRainbowPeriod_m;
  return hueToRgb(turns - std::floor(turns));
}

}  // namespace

MeshStore::MeshStore(float voxel_size_m) : voxel_size_m_(voxel_size_m) {}

void MeshStore::apply(const MeshUpdate& update) {
  for (const BlockMesh& block : update.blocks) put(std::make_shared<const BlockMesh>(block));
}

void MeshStore::put(SharedBlockMesh block) {
  const PackedKey key = packKey(block->key);
  const auto it = blocks_.find(key);
  if (it != blocks_.end()) triangle_count_ -= it->second->triangles.size() / 3;
  triangle_count_ += block->triangles.size() / 3;
  if (!block->triangles.empty()) {
    blocks_[key] = std::move(block);
  } else if (it != blocks_.end()) {
    blocks_.erase(it);
  }
}

void MeshStore::clear() {
  blocks_.clear();
  triangle_count_ = 0;
}

Vec3f MeshStore::positionInMap(const BlockKey& key, const BlockVertex& vertex) const {
  const double h = voxel_size_m_;
  const Vec3i first = firstVoxelOfBlock(key);
  return {static_cast<float>((first.x + static_cast<double>(vertex.position.x)) * h),
          static_cast<float>((first.y + static_cast<double>(vertex.position.y)) * h),
          static_cast<float>((first.z + static_cast<double>(vertex.position.z)) * h)};
}

Mesh MeshStore::assemble() const {
  Assembler assembler(*this);
  for (const auto& [key, block] : blocks_) assembler.add(*block);
  return assembler.finish();
}

Mesh MeshStore::assemble(const std::vector<PackedKey>& keys) const {
  Assembler assembler(*this);
  for (const PackedKey key : keys) {
    const auto it = blocks_.find(key);
    if (it != blocks_.end()) assembler.add(*it->second);
  }
  return assembler.finish();
}

PackedKey packedKeyOf(const BlockKey& key) { return packKey(key); }

std::array<uint8_t, 3> vertexColour(MeshColour mode, const Mesh& mesh, size_t vertex) {
  switch (mode) {
    case MeshColour::kAuto:
      return vertexColour(mesh.colours.empty() ? MeshColour::kNormal : MeshColour::kImage, mesh,
                          vertex);
    case MeshColour::kImage:
      if (!mesh.colours.empty() && mesh.colours[vertex].painted) {
        const VertexColour& colour = mesh.colours[vertex];
        return {colour.red, colour.green, colour.blue};
      }
      break;
    case MeshColour::kNormal:
      return normalColour(mesh.normals[vertex]);
    case MeshColour::kHeight:
      return heightColour(mesh.vertices_m[vertex].z);
    case MeshColour::kPlain:
      break;
  }
  return {200, 200, 200};
}

}  // namespace dtsdf
