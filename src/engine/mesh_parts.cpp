#include "engine/mesh_parts.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "map/block_cells.h"

namespace dtsdf {
namespace {

std::vector<PackedKey> movedBy(const Vec3i& step, const std::vector<PackedKey>& keys) {
  std::vector<PackedKey> moved;
  moved.reserve(keys.size());
  for (const PackedKey key : keys) {
    const BlockKey block = unpackKey(key) + step;
    if (isRepresentable(block)) moved.push_back(packKey(block));
  }
  return moved;
}

}  // namespace

/// Extends the list along one axis at a time. Shifted lists stay sorted, so they can be merged.
std::vector<PackedKey> blocksAround(std::vector<PackedKey> keys) {
  std::sort(keys.begin(), keys.end());
  for (const Vec3i& axis : {Vec3i{1, 0, 0}, Vec3i{0, 1, 0}, Vec3i{0, 0, 1}}) {
    const std::vector<PackedKey> narrow = keys;
    for (int32_t i = -kMeshReach; i <= kMeshReach; ++i) {
      const std::vector<PackedKey> moved = movedBy({i * axis.x, i * axis.y, i * axis.z}, narrow);
      std::vector<PackedKey> wider;
      wider.reserve(keys.size() + moved.size());
      std::set_union(keys.begin(), keys.end(), moved.begin(), moved.end(),
                     std::back_inserter(wider));
      keys = std::move(wider);
    }
  }
  return keys;
}

std::vector<PackedKey> keysOf(const std::vector<MarkedKey>& marked) {
  std::vector<PackedKey> keys;
  keys.reserve(marked.size());
  for (const auto& [key, marks] : marked) keys.push_back(key);
  return keys;
}

void sortForTurns(std::vector<MarkedKey>& marked, PackedKey first) {
  const auto place = [](PackedKey key) {
    return std::pair(packKey(cellOfBlock(unpackKey(key))), key);
  };
  std::sort(marked.begin(), marked.end(), [&](const MarkedKey& a, const MarkedKey& b) {
    return place(a.first) < place(b.first);
  });
  const auto turn = std::find_if(marked.begin(), marked.end(), [&](const MarkedKey& one) {
    return place(one.first) >= place(first);
  });
  std::rotate(marked.begin(), turn, marked.end());
}

void addMeshes(MeshUpdate part, MeshUpdate& made) {
  made.duration_ms += part.duration_ms;
  std::vector<BlockMesh>& all = made.blocks;
  if (all.empty()) {
    all = std::move(part.blocks);
    return;
  }
  std::move(part.blocks.begin(), part.blocks.end(), std::back_inserter(all));
  std::stable_sort(all.begin(), all.end(), [](const BlockMesh& a, const BlockMesh& b) {
    return packKey(a.key) < packKey(b.key);
  });
  const auto earlier = std::unique(all.rbegin(), all.rend(),
                                   [](const auto& a, const auto& b) { return a.key == b.key; });
  all.erase(all.begin(), earlier.base());
}

}  // namespace dtsdf
