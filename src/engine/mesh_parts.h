/// Mesh extraction in several parts, for when the blocks involved do not all fit in memory at once.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "backend/map_backend.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {

/// A block affects meshes up to this many blocks away.
constexpr int32_t kMeshReach = 2;

/// With this radius, in voxels, mayBeInView() accepts all blocks that the meshes of an image's
/// changed blocks depend on.
constexpr float kMeshedRadius = kFootRadius + 1.7321f * kMeshReach * kBlockSide;

template <class T>
void sortUnique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// A block to mesh again.
using MarkedKey = std::pair<PackedKey, MeshMarks>;

/// The blocks in `keys` and all blocks within kMeshReach of them, on which their meshes depend;
/// sorted, without duplicates.
std::vector<PackedKey> blocksAround(std::vector<PackedKey> keys);
std::vector<PackedKey> keysOf(const std::vector<MarkedKey>& marked);

/// Sorts blocks for meshing, cell by cell, starting at `first` and wrapping around, so that every
/// block gets its turn even if a camera keeps changing others.
void sortForTurns(std::vector<MarkedKey>& marked, PackedKey first);

/// Adds the meshes of a part to those of earlier parts. If both have a mesh of a block, the later
/// one is kept.
void addMeshes(MeshUpdate part, MeshUpdate& made);

}  // namespace dtsdf
