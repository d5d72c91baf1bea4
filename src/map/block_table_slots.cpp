/// Which of the table's blocks lie where.
#include <algorithm>
#include <cmath>
#include <utility>

#include "map/block_table.h"

namespace dtsdf {
namespace {

/// Of a point from the farthest one of a cell, in voxels, at most.
double squaredReach(const BlockCells::Cell& cell, const Vec3d& p) {
  constexpr double kHalf = 0.5 * BlockCells::kSide * kBlockSide;
  const auto outermost = [](int32_t key, double at) {
    return std::fabs((2.0 * key + 1.0) * kHalf - at) + kHalf;
  };
  const double x = outermost(cell.key.x, p.x), y = outermost(cell.key.y, p.y),
               z = outermost(cell.key.z, p.z);
  return x * x + y * y + z * z;
}

}  // namespace

double squaredDistance(const BlockKey& block, const Vec3d& p) {
  const auto outside = [](int32_t key, double at) {
    const double first = static_cast<double>(key) * kBlockSide, beyond = first + kBlockSide;
    return at < first ? first - at : (at > beyond ? at - beyond : 0.0);
  };
  const double x = outside(block.x, p.x), y = outside(block.y, p.y), z = outside(block.z, p.z);
  return x * x + y * y + z * z;
}

std::vector<int32_t> BlockTable::slotsIn(const RegionView& region) const {
  std::vector<int32_t> slots;
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const auto slot = static_cast<int32_t>(i);
    const BlockEntry& entry = blocks_[i];
    if (entry.in_use && mayBeInside(region, entry.key) && hasArrays(slot)) slots.push_back(slot);
  }
  return slots;
}

std::vector<int32_t> BlockTable::slotsInView(const FrameView& frame, float radius) const {
  std::vector<int32_t> slots;
  cells_.visitInView(frame, radius, [&](const BlockCells::Cell& cell) {
    slots.insert(slots.end(), cell.slots.begin(), cell.slots.end());
  });
  return slots;
}

std::vector<int32_t> BlockTable::slotsBeyond(const KeptBall& kept) const {
  const double limit = kept.radius * kept.radius;
  std::vector<int32_t> beyond;
  for (const BlockCells::Cell& cell : cells_.all()) {
    if (squaredReach(cell, kept.center) <= limit) continue;  // none of its blocks is beyond
    for (const int32_t slot : cell.slots) {
      const bool is_far = squaredDistance(blocks_[slot].key, kept.center) > limit;
      if (is_far && hasArrays(slot)) beyond.push_back(slot);
    }
  }
  return beyond;
}

std::vector<int32_t> BlockTable::sortedSlots() const {
  std::vector<std::pair<PackedKey, int32_t>> entries;
  entries.reserve(slots_.size());
  for (size_t slot = 0; slot < blocks_.size(); ++slot) {
    if (!blocks_[slot].in_use) continue;
    entries.emplace_back(packKey(blocks_[slot].key), static_cast<int32_t>(slot));
  }
  std::sort(entries.begin(), entries.end());
  std::vector<int32_t> slots;
  slots.reserve(entries.size());
  for (const auto& [key, slot] : entries) slots.push_back(slot);
  return slots;
}

}  // namespace dtsdf
