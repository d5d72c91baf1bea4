/// Extraction in parts, for when the blocks that it needs do not fit into memory at once.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "backend/map_backend.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {

/// Largest reach of the rules of meshing, in blocks.
constexpr int32_t kMeshReach = 2;

/// Radius for mayBeInView(), in voxels, around a block that a depth image changes, such that all
/// blocks that its mesh depends on are within.
constexpr float kMeshedRadius = kFootRadius + 1.7321f * kMeshReach * kBlockSide;

/// Sorts values and removes duplicates.
template <class T>
void sortUnique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// A block to mesh again.
using MarkedKey = std::pair<PackedKey, MeshMarks>;

/// All blocks within kMeshReach of these, which their meshes depend on, sorted, each once.
std::vector<PackedKey> blocksAround(std::vector<PackedKey> keys);
std::vector<PackedKey> keysOf(const std::vector<MarkedKey>& marked);

/// Sorts blocks for meshing: cell by cell, beginning at a key and wrapping round, so that all get
/// their turn, whatever a camera changes meanwhile.
void sortForTurns(std::vector<MarkedKey>& marked, PackedKey first);

/// Adds the meshes of a part to those of earlier parts. If both contain a block, the later mesh is
/// kept, since all blocks around it were up to date.
void addMeshes(MeshUpdate part, MeshUpdate& made);

}  // namespace dtsdf
