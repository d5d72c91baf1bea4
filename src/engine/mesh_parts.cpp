#include "engine/mesh_parts.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "map/block_cells.h"
#include "page/paged_meshes.h"

namespace dtsdf {
namespace {

int longestAxis(const std::vector<MarkedKey>& marked) {
  BlockKey low = unpackKey(marked.front().key), high = low;
  for (const MarkedKey& block : marked) {
    low = leastOf(low, unpackKey(block.key));
    high = greatestOf(high, unpackKey(block.key));
  }
  const Vec3i size = high - low;
  if (size.x >= size.y && size.x >= size.z) return 0;
  return size.y >= size.z ? 1 : 2;
}

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

/// Axis by axis. A list that is moved stays sorted, so that lists are merged and never sorted.
std::vector<PackedKey> blocksAround(const std::vector<MarkedKey>& marked) {
  std::vector<PackedKey> keys;
  keys.reserve(marked.size());
  for (const MarkedKey& block : marked) keys.push_back(block.key);
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

std::unordered_set<PackedKey> cellsAround(const std::vector<MarkedKey>& marked) {
  constexpr Vec3i kReach{kMeshReach, kMeshReach, kMeshReach};
  std::unordered_set<PackedKey> cells;
  Vec3i last_low{}, last_high{};
  for (const MarkedKey& block : marked) {
    const Vec3i low = cellOfBlock(unpackKey(block.key) - kReach);
    const Vec3i high = cellOfBlock(unpackKey(block.key) + kReach);
    if (!cells.empty() && low == last_low && high == last_high) continue;
    last_low = low;
    last_high = high;
    for (int32_t z = low.z; z <= high.z; ++z) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t x = low.x; x <= high.x; ++x) cells.insert(packKey({x, y, z}));
      }
    }
  }
  return cells;
}

std::vector<MarkedKey> takeHalf(std::vector<MarkedKey>& marked) {
  const int axis = longestAxis(marked);
  const auto middle = marked.begin() + static_cast<std::ptrdiff_t>(marked.size() / 2);
  std::nth_element(marked.begin(), middle, marked.end(),
                   [axis](const MarkedKey& a, const MarkedKey& b) {
                     const int32_t at_a = component(unpackKey(a.key), axis);
                     const int32_t at_b = component(unpackKey(b.key), axis);
                     return at_a != at_b ? at_a < at_b : a.key < b.key;
                   });
  std::vector<MarkedKey> half(middle, marked.end());
  marked.erase(middle, marked.end());
  return half;
}

size_t bytesOf(const MeshUpdate& update) {
  size_t bytes = 0;
  for (const BlockMesh& block : update.blocks) bytes += bytesOf(block);
  return bytes;
}

void addMeshes(MeshUpdate part, MeshUpdate& made) {
  made.duration_ms += part.duration_ms;
  std::vector<BlockMesh>& all = made.blocks;
  if (all.empty()) {
    all = std::move(part.blocks);
    return;
  }
  std::vector<BlockMesh> merged;
  merged.reserve(all.size() + part.blocks.size());
  auto earlier = all.begin();
  for (BlockMesh& mesh : part.blocks) {
    const PackedKey key = packKey(mesh.key);
    for (; earlier != all.end() && packKey(earlier->key) <= key; ++earlier) {
      if (packKey(earlier->key) < key) merged.push_back(std::move(*earlier));
    }
    merged.push_back(std::move(mesh));
  }
  std::move(earlier, all.end(), std::back_inserter(merged));
  all = std::move(merged);
}

}  // namespace dtsdf
