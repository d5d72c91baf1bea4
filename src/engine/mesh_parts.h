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

/// With this radius, in voxels, mayBeInView() accepts all blocks that affect the meshes of the
/// blocks changed by an image.
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

/// Sorts blocks for meshing, grouped by cell (BlockCells). Starts at `first` and wraps around, so
/// that every block is meshed eventually, even if the camera keeps changing other blocks.
void sortForTurns(std::vector<MarkedKey>& marked, PackedKey first);

/// Adds the meshes of a part to those of earlier parts. For a block with meshes in both, the mesh
/// of the new part is kept.
void addMeshes(MeshUpdate part, MeshUpdate& made);

}  // namespace dtsdf
