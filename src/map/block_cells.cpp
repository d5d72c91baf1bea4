#include "map/block_cells.h"

#include <cmath>
#include <utility>

namespace dtsdf {

BlockCells::Cell& BlockCells::cellOf(const BlockKey& block) {
  const Vec3i key = cellOfBlock(block);
  if (last_ < cells_.size() && cells_[last_].key == key) return cells_[last_];
  const int32_t number = numbers_.find(packKey(key));
  last_ = number >= 0 ? static_cast<size_t>(number) : cells_.size();
  if (number >= 0) return cells_[last_];
  const auto next = static_cast<int32_t>(cells_.size());
  if (groups_) groups_->insert(key, next);
  numbers_.insert(packKey(key), next);
  cells_.push_back({key, {}, 0});
  return cells_.back();
}

void BlockCells::insert(const BlockKey& block, int32_t slot) {
  if (places_.size() <= static_cast<size_t>(slot)) places_.resize(static_cast<size_t>(slot) + 1);
  std::vector<int32_t>& slots = cellOf(block).slots;
  slots.push_back(slot);
  places_[static_cast<size_t>(slot)] = static_cast<uint32_t>(slots.size() - 1);
}

/// Moves the last slot of the cell's list into the gap.
void BlockCells::erase(const BlockKey& block, int32_t slot) noexcept {
  const PackedKey key = packKey(cellOfBlock(block));
  const int32_t number = numbers_.find(key);
  Cell& cell = cells_[static_cast<size_t>(number)];
  const uint32_t place = places_[static_cast<size_t>(slot)];
  cell.slots[place] = cell.slots.back();
  places_[static_cast<size_t>(cell.slots[place])] = place;
  cell.slots.pop_back();
  if (!cell.slots.empty()) return;
  numbers_.erase(key);
  if (groups_) groups_->erase(cell.key, number);
  if (&cell != &cells_.back()) {
    const Vec3i& moved = cells_.back().key;
    numbers_.assign(packKey(moved), number);
    if (groups_) groups_->renumber(moved, static_cast<int32_t>(cells_.size()) - 1, number);
    cell = std::move(cells_.back());
  }
  cells_.pop_back();
}

/// @pre The new slot is unused, and no larger than the largest slot ever used.
void BlockCells::renumber(const BlockKey& block, int32_t slot, int32_t new_slot) noexcept {
  const uint32_t place = places_[static_cast<size_t>(slot)];
  const int32_t number = numbers_.find(packKey(cellOfBlock(block)));
  cells_[static_cast<size_t>(number)].slots[place] = new_slot;
  places_[static_cast<size_t>(new_slot)] = place;
}

void BlockCells::clear() { *this = BlockCells(); }

size_t BlockCells::memoryBytes() const {
  return (groups_ ? groups_->memoryBytes() : 0) + numbers_.memoryBytes() +
         cells_.capacity() * sizeof(Cell) +
         2 * places_.capacity() * sizeof(uint32_t);  // each slot is also listed once in a cell
}

bool mayBeInView(const FrameView& frame, const Vec3i& cube, int side, float radius) {
  const BlockKey first{cube.x * side, cube.y * side, cube.z * side};
  const auto voxels = static_cast<float>(side * kBlockSide);
  // Largest distance from a block's centre to the cube's centre; 0.8661 is half the square root of
  // 3.
  const float reach = 0.8661f * (voxels - static_cast<float>(kBlockSide));
  // Bounds on the rounding errors of this test and of mayBeInView() for blocks, for any field of
  // view.
  constexpr float kRounding = 1e-5f, kMinRounding = 0.1f;
  const float half = 0.5f * voxels;
  const Vec3f middle = toFloat(firstVoxelOfBlock(first - blockOfVoxel(frame.origin_voxel))) +
                       Vec3f{half, half, half};
  const float far = std::fabs(middle.x) + std::fabs(middle.y) + std::fabs(middle.z);
  return mayBeInView(frame, middle, radius + reach + kMinRounding + kRounding * far);
}

}  // namespace dtsdf
