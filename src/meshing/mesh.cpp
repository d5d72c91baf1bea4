#include "dtsdf_mapping/mesh.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "map/region_view.h"
#include "meshing/mesh_stream.h"

namespace dtsdf {
namespace {

/// Drops triangles with a corner outside the region, and unused vertices. The region is in metres.
void crop(const RegionView& region, Mesh& mesh) {
  std::vector<uint8_t> is_inside(mesh.vertices_m.size());
  for (size_t i = 0; i < is_inside.size(); ++i) {
    const std::array<double, 3> p_W = positionInMap(mesh, i);
    is_inside[i] = isInside(region, Vec3d{p_W[0], p_W[1], p_W[2]}) ? 1 : 0;
  }
  std::vector<uint8_t> is_kept(mesh.vertices_m.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    if ((is_inside[a] & is_inside[b] & is_inside[c]) == 1) is_kept[a] = is_kept[b] = is_kept[c] = 1;
  }
  keepVertices(mesh, is_kept);
}

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

std::array<uint8_t, 3> heightColour(double z_m) {
  constexpr double kRainbowPeriod_m = 3.0;
  const double turns = z_m / kRainbowPeriod_m;
  return hueToRgb(static_cast<float>(turns - std::floor(turns)));
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

std::array<double, 3> MeshStore::positionInMap(const BlockKey& key,
                                               const BlockVertex& vertex) const {
  const double h = voxel_size_m_;
  const Vec3i first = firstVoxelOfBlock(key);
  return {(first.x + static_cast<double>(vertex.position.x)) * h,
          (first.y + static_cast<double>(vertex.position.y)) * h,
          (first.z + static_cast<double>(vertex.position.z)) * h};
}

/// Joins block meshes, sorted by packed key, into the mesh that MeshStream would output, using
/// little more memory than the mesh itself takes.
Mesh MeshStore::join(const std::vector<const BlockMesh*>& blocks) const {
  size_t vertices = 0, triangles = 0;
  BlockExtent bounds = noBlocks();
  for (const BlockMesh* block : blocks) {
    vertices += block->vertices.size();
    triangles += block->triangles.size() / 3;
    bounds = around(bounds, {block->key, block->key});
  }
  Mesh mesh;
  std::optional<BlockJoiner> joiner(std::in_place);
  Outline outline;
  mesh.origin_m = originOf(bounds, voxel_size_m_);
  // Reserves enough to avoid reallocation. Memory that is never touched costs nothing.
  mesh.vertices_m.reserve(vertices);
  mesh.normals.reserve(vertices);
  mesh.triangles.reserve(triangles + vertices);  // closing a hole of n vertices adds n - 2
  outline.reserve(vertices);
  for (const BlockMesh* block : blocks) {
    const JoinedBlock& joined = joiner->add(*block);
    for (const uint32_t i : joined.fresh) {
      const BlockVertex& vertex = block->vertices[i];
      mesh.vertices_m.push_back(positionFrom(mesh.origin_m, positionInMap(block->key, vertex)));
      mesh.normals.push_back({0.0f, 0.0f, 0.0f});
      outline.addVertex(outlineKind(vertex));
      if (block->colours.empty()) continue;  // meshed before the map was first painted
      if (mesh.colours.empty()) mesh.colours.reserve(vertices);
      mesh.colours.resize(mesh.vertices_m.size() - 1);
      mesh.colours.push_back(block->colours[i]);
    }
    for (size_t t = 0; t + 2 < block->triangles.size(); t += 3) {
      const uint16_t* const corner = &block->triangles[t];
      mesh.triangles.push_back(
          {joined.number[corner[0]], joined.number[corner[1]], joined.number[corner[2]]});
      addNormal(*block, joined, corner, mesh.triangles.back(), mesh.normals);
      outline.addTriangle(mesh.triangles.back());
    }
  }
  joiner.reset();  // frees memory for mending
  if (!mesh.colours.empty()) mesh.colours.resize(mesh.vertices_m.size());
  mendMesh(mesh, outline, voxel_size_m_);
  makeUnit(mesh.normals);
  return mesh;
}

Mesh MeshStore::assemble() const {
  std::vector<const BlockMesh*> blocks;
  blocks.reserve(blocks_.size());
  for (const auto& [key, block] : blocks_) blocks.push_back(block.get());
  return join(blocks);
}

Mesh MeshStore::assemble(const BoxRegion& region) const {
  const RegionView in_voxels = makeRegionView(region, voxel_size_m_);
  std::vector<const BlockMesh*> blocks;
  for (const auto& [key, block] : blocks_) {
    if (mayAffectMeshIn(in_voxels, block->key)) blocks.push_back(block.get());
  }
  Mesh mesh = join(blocks);
  crop(makeRegionView(region, 1.0), mesh);
  return mesh;
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
    case MeshColour::kNormal: return normalColour(mesh.normals[vertex]);
    case MeshColour::kHeight: return heightColour(positionInMap(mesh, vertex)[2]);
    case MeshColour::kPlain: break;
  }
  return {200, 200, 200};
}

}  // namespace dtsdf
