/// An extraction in parts, where the blocks that it needs do not fit into memory at once.
#pragma once

#include <algorithm>
#include <vector>

#include "backend/map_backend.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {

/// No rule of meshing reaches farther, in blocks.
constexpr int32_t kMeshReach = 2;

/// From the middle of a block that a depth image changes to those that its mesh depends on: see
/// mayBeInView().
constexpr float kMeshedRadius = kFootRadius + 1.7321f * kMeshReach * kBlockSide;

/// In ascending order.
template <class T>
void keepEachOnce(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// A block that is to be meshed again.
struct MarkedKey {
  PackedKey key;
  MeshMarks marks;
};

/// All blocks that the meshes around these depend on, sorted, each once: no rule of meshing reaches
/// beyond two blocks.
std::vector<PackedKey> blocksAround(std::vector<PackedKey> keys);
std::vector<PackedKey> keysOf(const std::vector<MarkedKey>& marked);

/// Puts blocks into the order in which they are meshed: cell by cell, from a block's key on, so
/// that all get their turn, whatever a camera changes meanwhile.
void sortForTurns(std::vector<MarkedKey>& marked, PackedKey first);

/// Adds the meshes of a part to those of the parts before: where both have a block, that of the
/// later one is right, as all around it was up to date.
void addMeshes(MeshUpdate part, MeshUpdate& made);

}  // namespace dtsdf
