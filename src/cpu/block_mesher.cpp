#include "cpu/block_mesher.h"

#include <algorithm>
#include <iterator>

#include "cpu/parallel_for.h"

namespace dtsdf {
namespace {

/// The samples at the corners of a block's units, collected from the block and its neighbours.
struct BlockLattice {
  Voxel corner[kDirectionCount][kLatticeCorners];
  uint32_t present;  ///< Bit d: some of the blocks has an array of direction d.
  bool directional;
};

void collectLattice(const BlockTable& table, VoxelStore& voxels, const BlockKey& key,
                    BlockLattice& lattice) {
  const Voxel* arrays[kLatticeBlocks][kDirectionCount] = {};
  lattice.present = 0;
  for (int n = 0; n < kLatticeBlocks; ++n) {
    const int32_t slot = table.find(packKey(key + latticeBlockOffset(n)));
    if (slot < 0) continue;
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = table.block(slot).array[d];
      if (array == kNoArray) continue;
      arrays[n][d] = voxels.array(array);
      lattice.present |= 1u << d;
    }
  }
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(lattice.present >> d & 1)) continue;
    for (int i = 0; i < kLatticeCorners; ++i) {
      const LatticeSource source = latticeSource(i);
      const Voxel* voxels_of_block = arrays[source.block][d];
      lattice.corner[d][i] =
          voxels_of_block == nullptr ? Voxel{0.0f, 0.0f} : voxels_of_block[source.voxel];
    }
  }
}

/// For each corner of a lattice the directions that see it in front (bit d) and behind (bit 8 + d).
void markSides(const BlockLattice& lattice, uint16_t (&sides)[kLatticeCorners]) {
  std::fill(std::begin(sides), std::end(sides), uint16_t{0});
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(lattice.present >> d & 1)) continue;
    for (int i = 0; i < kLatticeCorners; ++i) {
      const Voxel& voxel = lattice.corner[d][i];
      if (voxel.weight > 0.0f) sides[i] |= 1u << (voxel.sdf < 0.0f ? 8 + d : d);
    }
  }
}

/// Position of corner c of a unit in the lattice.
int unitCorner(const Vec3i& unit, int c) {
  return latticeIndex(unit.x + (c & 1), unit.y + (c >> 1 & 1), unit.z + (c >> 2 & 1));
}

std::vector<UnitIndices> indexUnits(const BlockLattice& lattice, bool directional) {
  uint16_t sides[kLatticeCorners];
  markSides(lattice, sides);
  std::vector<UnitIndices> indices(kVoxelsPerBlock, UnitIndices{{0, 0}});
  UnitSamples samples = {};
  bool any = false;
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i unit = voxelOffset(i);
    // No surface can be where no direction sees both sides of one; most units end here.
    unsigned seen = 0;
    for (int c = 0; c < kCubeCorners; ++c) seen |= sides[unitCorner(unit, c)];
    if ((seen & seen >> 8) == 0) continue;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!(lattice.present >> d & 1)) continue;
      for (int c = 0; c < kCubeCorners; ++c) {
        samples.corner[d][c] = lattice.corner[d][unitCorner(unit, c)];
      }
    }
    indices[i] = indexUnit(kMeshTables, samples, directional);
    any |= indices[i].sheet[0] != 0;
  }
  if (!any) indices.clear();
  return indices;
}

bool sameIndices(const std::vector<UnitIndices>& a, const std::vector<UnitIndices>& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const UnitIndices& x, const UnitIndices& y) {
           return x.sheet[0] == y.sheet[0] && x.sheet[1] == y.sheet[1];
         });
}

/// Indices of the units in a block and in its six face neighbours.
struct IndexNeighbourhood {
  /// By regularisationOffset(); null where there is no surface.
  const UnitIndices* block[kRegularisationReach];

  UnitIndices operator()(const Vec3i& unit) const {
    const UnitSource source = unitSource(unit);
    const UnitIndices* indices = block[source.block];
    return indices == nullptr ? UnitIndices{{0, 0}} : indices[source.unit];
  }
};

float vertexOffset(const BlockLattice& lattice, int edge) {
  const int lower = edgeCorner(edge), axis = edgeAxis(edge), facing = edgeFacing(edge);
  const int stride = latticeStride(axis);
  EdgeSamples samples = {};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(lattice.present >> d & 1)) continue;
    const int direction = directionOnEdge(d, axis, facing, lattice.directional);
    samples.lower[direction] = lattice.corner[d][lower];
    samples.upper[direction] = lattice.corner[d][lower + stride];
  }
  return edgeOffset(samples, axis, facing);
}

/// Turns lattice edges into indices of a sorted vertex list, and places the vertices.
void placeVertices(const BlockLattice& lattice, const std::vector<int>& triangle_edges,
                   BlockMesh& mesh) {
  std::vector<int> edges = triangle_edges;
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::vector<uint16_t> number(kLatticeEdges);
  for (const int edge : edges) {
    number[edge] = static_cast<uint16_t>(mesh.vertices.size());
    mesh.vertices.push_back(
        {vertexPosition(edge, vertexOffset(lattice, edge)), static_cast<uint32_t>(edge)});
  }
  for (const int edge : triangle_edges) mesh.triangles.push_back(number[edge]);
}

BlockMesh emitBlock(const BlockLattice& lattice, const IndexNeighbourhood& indices,
                    const BlockKey& key) {
  BlockMesh mesh;
  mesh.key = key;
  if (indices.block[0] == nullptr) return mesh;
  std::vector<int> triangle_edges;
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i unit = voxelOffset(i);
    const UnitIndices settled = settleUnit(indices, unit);
    for (const uint8_t index : settled.sheet) {
      for (int k = 0; k < 3 * kMeshTables.triangle_count[index]; ++k) {
        triangle_edges.push_back(unitEdge(unit, kMeshTables.triangle_edge[index][k], index));
      }
    }
  }
  placeVertices(lattice, triangle_edges, mesh);
  return mesh;
}

std::vector<Vec3i> unitReach() {
  std::vector<Vec3i> offsets;
  for (int n = 0; n < kUnitReach; ++n) offsets.push_back(unitReachOffset(n));
  return offsets;
}

std::vector<Vec3i> regularisationReach() {
  std::vector<Vec3i> offsets;
  for (int n = 0; n < kRegularisationReach; ++n) offsets.push_back(regularisationOffset(n));
  return offsets;
}

}  // namespace

BlockMesher::BlockMesher(const BlockTable& table, VoxelStore& voxels, bool directional, int threads)
    : table_(table), voxels_(voxels), directional_(directional), threads_(threads) {}

void BlockMesher::resize() {
  if (state_.size() < table_.slotCount()) state_.resize(table_.slotCount());
}

void BlockMesher::clear() { state_.clear(); }

std::vector<int32_t> BlockMesher::takeDirty() {
  std::vector<int32_t> dirty;
  for (size_t slot = 0; slot < state_.size(); ++slot) {
    if (state_[slot].dirty) dirty.push_back(static_cast<int32_t>(slot));
    state_[slot].dirty = false;
  }
  return dirty;
}

std::vector<int32_t> BlockMesher::withNeighbours(const std::vector<int32_t>& slots,
                                                 const std::vector<Vec3i>& offsets) const {
  std::vector<int32_t> result;
  for (const int32_t slot : slots) {
    for (const Vec3i& offset : offsets) {
      const int32_t neighbour = table_.find(packKey(table_.block(slot).key + offset));
      if (neighbour >= 0) result.push_back(neighbour);
    }
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

std::vector<int32_t> BlockMesher::indexBlocks(const std::vector<int32_t>& slots) {
  const StageTimer timer(profile_, Stage::kIndex);
  std::vector<uint8_t> changed(slots.size(), 0);
  parallelFor<BlockLattice>(slots.size(), threads_, [&](size_t i, BlockLattice& lattice) {
    collectLattice(table_, voxels_, table_.block(slots[i]).key, lattice);
    std::vector<UnitIndices> indices = indexUnits(lattice, directional_);
    std::vector<UnitIndices>& previous = state_[slots[i]].indices;
    changed[i] = !sameIndices(indices, previous);
    previous = std::move(indices);
  });
  std::vector<int32_t> result;
  for (size_t i = 0; i < slots.size(); ++i) {
    if (changed[i]) result.push_back(slots[i]);
  }
  return result;
}

std::vector<BlockMesh> BlockMesher::emitBlocks(const std::vector<int32_t>& slots) const {
  const StageTimer timer(profile_, Stage::kMake);
  std::vector<BlockMesh> meshes(slots.size());
  const auto indicesOf = [&](int32_t slot) {
    return slot < 0 || state_[slot].indices.empty() ? nullptr : state_[slot].indices.data();
  };
  parallelFor<BlockLattice>(slots.size(), threads_, [&](size_t i, BlockLattice& lattice) {
    const BlockKey key = table_.block(slots[i]).key;
    IndexNeighbourhood indices;
    for (int n = 0; n < kRegularisationReach; ++n) {
      indices.block[n] = indicesOf(table_.find(packKey(key + regularisationOffset(n))));
    }
    lattice.directional = directional_;
    if (indices.block[0] != nullptr) collectLattice(table_, voxels_, key, lattice);
    meshes[i] = emitBlock(lattice, indices, key);
  });
  return meshes;
}

std::vector<int32_t> BlockMesher::reachBlocks() {
  const StageTimer timer(profile_, Stage::kReach);
  return withNeighbours(takeDirty(), unitReach());
}

size_t BlockMesher::bytes() const {
  size_t bytes = state_.capacity() * sizeof(SlotState);
  for (const SlotState& state : state_) bytes += state.indices.capacity() * sizeof(UnitIndices);
  return bytes;
}

std::vector<BlockMesh> BlockMesher::update() {
  const std::vector<int32_t> reached = reachBlocks();
  const std::vector<int32_t> settled = withNeighbours(indexBlocks(reached), regularisationReach());
  std::vector<int32_t> slots;
  std::set_union(settled.begin(), settled.end(), reached.begin(), reached.end(),
                 std::back_inserter(slots));

  std::vector<BlockMesh> meshes = emitBlocks(slots);
  const StageTimer timer(profile_, Stage::kHandOut);
  std::vector<BlockMesh> changes;
  for (size_t i = 0; i < slots.size(); ++i) {
    SlotState& state = state_[slots[i]];
    const bool has_mesh = !meshes[i].triangles.empty();
    if (has_mesh || state.has_mesh) changes.push_back(std::move(meshes[i]));
    state.has_mesh = has_mesh;
  }
  std::sort(changes.begin(), changes.end(), [](const BlockMesh& a, const BlockMesh& b) {
    return packKey(a.key) < packKey(b.key);
  });
  if (profile_ != nullptr) {
    profile_->work.indexed_blocks += reached.size();
    profile_->work.meshed_blocks += slots.size();
    for (const BlockMesh& mesh : changes) {
      profile_->work.vertices += mesh.vertices.size();
      profile_->work.triangles += mesh.triangles.size() / 3;
    }
  }
  return changes;
}

}  // namespace dtsdf
