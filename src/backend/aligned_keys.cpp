#include "backend/aligned_keys.h"

#include <algorithm>

#include "map/block_extent.h"

namespace dtsdf {
namespace {

BlockExtent blocksAround(const FrameView& view, const Vec3f& p_L, float reach) {
  const auto blockAt = [&](float side) {
    return blockOfVoxel(view.origin_voxel + Vec3i{floorToInt(p_L.x + side * reach),
                                                  floorToInt(p_L.y + side * reach),
                                                  floorToInt(p_L.z + side * reach)});
  };
  return {blockAt(-1.0f), blockAt(1.0f)};
}

void addBlocks(const BlockExtent& box, std::vector<PackedKey>& keys) {
  for (int32_t z = box.first.z; z <= box.last.z; ++z) {
    for (int32_t y = box.first.y; y <= box.last.y; ++y) {
      for (int32_t x = box.first.x; x <= box.last.x; ++x) {
        if (isRepresentable({x, y, z})) keys.push_back(packKey({x, y, z}));
      }
    }
  }
}

}  // namespace

/// Points come row by row: most look at the blocks that the one before them does.
std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff, const AlignedPoint* points,
                                   size_t count) {
  constexpr float kAround = 2.0f;  // a sample is of the voxels around a place
  std::vector<PackedKey> keys;
  BlockExtent before = noBlocks();
  for (size_t i = 0; i < count; ++i) {
    if (!(points[i].weight > 0.0f)) continue;
    const Vec3f lever = rotate(view.T_L_C, points[i].p_C);
    if (!(norm(lever) < kLongestLever)) continue;
    const BlockExtent box = blocksAround(view, lever + view.T_L_C.t, cutoff + kAround);
    if (box.first == before.first && box.last == before.last) continue;
    addBlocks(box, keys);
    before = box;
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace dtsdf
