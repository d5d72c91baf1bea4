/// Blocks by coarse cells of the grid, so that what is in view is found without a look at each.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "map/slot_index.h"

namespace dtsdf {

/// Cells of kSide x kSide x kSide blocks; only those with blocks are there.
class BlockCells {
 public:
  static constexpr int kSideLog2 = 4;
  static constexpr int kSide = 1 << kSideLog2;

  struct Cell {
    Vec3i key;                   ///< Coordinates of its first block, divided by kSide.
    std::vector<int32_t> slots;  ///< Slots of its blocks, in no order.
    uint64_t last_need = 0;      ///< The latest note() of one of its blocks.
  };

  BlockCells() : BlockCells(true) {}

  /// @throws std::bad_alloc and nothing has changed then.
  void insert(const BlockKey& block, int32_t slot);
  void erase(const BlockKey& block, int32_t slot) noexcept;
  void clear();

  /// Notes that a block was needed at a time. @pre It is there.
  void note(const BlockKey& block, uint64_t time) { cellOf(block).last_need = time; }

  const std::vector<Cell>& all() const { return cells_; }

  /// Calls visit(cell) for those that a frame may see something of: see mayBeInView(). Costs what
  /// is in view, and a look at each group of kSide x kSide x kSide cells.
  template <class Visit>
  void visitInView(const FrameView& frame, float radius, const Visit& visit) const;

  size_t memoryBytes() const;

 private:
  explicit BlockCells(bool has_groups) {
    if (has_groups) groups_.reset(new BlockCells(false));
  }
  Cell& cellOf(const BlockKey& block);
  void renumber(const BlockKey& block, int32_t slot, int32_t new_slot) noexcept;

  std::vector<Cell> cells_;
  size_t last_ = 0;                     ///< Number of the cell that was asked for last.
  SlotIndex numbers_;                   ///< Numbers of cells, by the packed key.
  std::vector<uint32_t> places_;        ///< Places of blocks in their cell's list, by slot.
  std::unique_ptr<BlockCells> groups_;  ///< Groups of cells, as cells are of blocks; null in these.
};

/// Key of the cell that a block lies in.
inline Vec3i cellOfBlock(const BlockKey& block) {
  constexpr int kShift = BlockCells::kSideLog2;
  return {block.x >> kShift, block.y >> kShift, block.z >> kShift};
}

/// Whether a frame may see anything of balls, `radius` voxels wide, around the middles of the
/// blocks of a cube, so many along each side of it: true wherever mayBeInView() is for one of them.
/// @param cube Coordinates of its first block, divided by `side`.
bool mayBeInView(const FrameView& frame, const Vec3i& cube, int side, float radius);

template <class Visit>
void BlockCells::visitInView(const FrameView& frame, float radius, const Visit& visit) const {
  constexpr int kGroupSide = kSide * kSide;
  for (const Cell& group : groups_->cells_) {
    if (!mayBeInView(frame, group.key, kGroupSide, radius)) continue;
    for (const int32_t number : group.slots) {
      const Cell& cell = cells_[static_cast<size_t>(number)];
      if (mayBeInView(frame, cell.key, kSide, radius)) visit(cell);
    }
  }
}

}  // namespace dtsdf
