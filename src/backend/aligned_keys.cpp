#include "backend/aligned_keys.h"

#include <algorithm>

namespace dtsdf {
namespace {

/// The blocks between two corners.
struct KeyBox {
  BlockKey first, last;

  bool operator==(const KeyBox& other) const { return first == other.first && last == other.last; }
  void addTo(std::vector<PackedKey>& keys) const {
    for (int32_t z = first.z; z <= last.z; ++z) {
      for (int32_t y = first.y; y <= last.y; ++y) {
        for (int32_t x = first.x; x <= last.x; ++x) {
          if (isRepresentable({x, y, z})) keys.push_back(packKey({x, y, z}));
        }
      }
    }
  }
};

KeyBox boxAround(const FrameView& view, const Vec3f& p_L, float reach) {
  const auto blockAt = [&](float side) {
    return blockOfVoxel(view.origin_voxel + Vec3i{floorToInt(p_L.x + side * reach),
                                                  floorToInt(p_L.y + side * reach),
                                                  floorToInt(p_L.z + side * reach)});
  };
  return {blockAt(-1.0f), blockAt(1.0f)};
}

}  // namespace

/// Points come row by row: most look at the blocks that the one before them does.
std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff, const AlignedPoint* points,
                                   size_t count) {
  constexpr float kAround = 2.0f;  // a sample is of the voxels around a place
  std::vector<PackedKey> keys;
  KeyBox before{{0, 0, 0}, {-1, -1, -1}};
  for (size_t i = 0; i < count; ++i) {
    if (!(points[i].weight > 0.0f)) continue;
    const Vec3f lever = rotate(view.T_L_C, points[i].p_C);
    if (!(norm(lever) < kLongestLever)) continue;
    const KeyBox box = boxAround(view, lever + view.T_L_C.t, cutoff + kAround);
    if (box == before) continue;
    box.addTo(keys);
    before = box;
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace dtsdf
