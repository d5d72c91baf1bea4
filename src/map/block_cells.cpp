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
  Cell cell{key, {}, 0};
  cell.slots.reserve(1);
  if (cells_.size() == cells_.capacity()) cells_.reserve(2 * cells_.size() + 1);
  numbers_.insert(packKey(key), static_cast<int32_t>(cells_.size()));
  cells_.push_back(std::move(cell));  // there is memory for it, and for a block in it
  return cells_.back();
}

void BlockCells::insert(const BlockKey& block, int32_t slot) {
  if (places_.size() <= static_cast<size_t>(slot)) places_.resize(static_cast<size_t>(slot) + 1);
  std::vector<int32_t>& slots = cellOf(block).slots;
  slots.push_back(slot);
  places_[static_cast<size_t>(slot)] = static_cast<uint32_t>(slots.size() - 1);
}

/// The last one of a list takes the place of the one that goes.
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
  if (&cell != &cells_.back()) {
    numbers_.assign(packKey(cells_.back().key), number);
    cell = std::move(cells_.back());
  }
  cells_.pop_back();
}

size_t BlockCells::memoryBytes() const {
  return numbers_.memoryBytes() + cells_.capacity() * sizeof(Cell) +
         2 * places_.capacity() * sizeof(uint32_t);  // the lists hold each slot once as well
}

bool mayBeInView(const FrameView& frame, const BlockCells::Cell& cell, float radius) {
  constexpr auto kCellVoxels = static_cast<float>(BlockCells::kSide * kBlockSide);
  // Middles of blocks are at most so far from the cell's: half the root of 3.
  constexpr float kReach = 0.8661f * (kCellVoxels - static_cast<float>(kBlockSide));
  // What the single precision of either test may be off, for cameras of any angle.
  constexpr float kRounding = 1e-5f, kLeastRounding = 0.1f;
  constexpr int kSide = BlockCells::kSide;
  const BlockKey first{cell.key.x * kSide, cell.key.y * kSide, cell.key.z * kSide};
  constexpr float kHalf = 0.5f * kCellVoxels;
  const Vec3f middle = toFloat(firstVoxelOfBlock(first - blockOfVoxel(frame.origin_voxel))) +
                       Vec3f{kHalf, kHalf, kHalf};
  const float far = std::fabs(middle.x) + std::fabs(middle.y) + std::fabs(middle.z);
  return mayBeInView(frame, middle, radius + kReach + kLeastRounding + kRounding * far);
}

}  // namespace dtsdf
