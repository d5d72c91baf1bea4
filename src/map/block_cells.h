/// Groups blocks into coarse cells, to find the blocks in view without visiting every block.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "map/slot_index.h"

namespace dtsdf {

/// Cells of kSide x kSide x kSide blocks. Cells without blocks are not stored.
class BlockCells {
 public:
  static constexpr int kSideLog2 = 4;
  static constexpr int kSide = 1 << kSideLog2;

  struct Cell {
    Vec3i key;                   ///< Coordinates of its first block, divided by kSide.
    std::vector<int32_t> slots;  ///< Slots of its blocks, in no particular order.
    uint64_t last_need = 0;      ///< Latest time passed to note() for one of its blocks.
  };

  BlockCells() : BlockCells(true) {}

  void insert(const BlockKey& block, int32_t slot);
  void erase(const BlockKey& block, int32_t slot) noexcept;
  void clear();

  /// Notes the time at which a block was needed. @pre The block was inserted.
  void note(const BlockKey& block, uint64_t time) { cellOf(block).last_need = time; }

  const std::vector<Cell>& all() const { return cells_; }

  /// Calls visit(cell) for each cell that may be partly in a frame's view; see mayBeInView(). The
  /// running time is proportional to the number of cells in the groups in view, plus the total
  /// number of groups; a group is kSide x kSide x kSide cells.
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
  size_t last_ = 0;                     ///< Index of the cell last returned by cellOf().
  SlotIndex numbers_;                   ///< Index of each cell, by packed key.
  std::vector<uint32_t> places_;        ///< Position of each block in its cell's list, by slot.
  std::unique_ptr<BlockCells> groups_;  ///< Groups of cells; null in the groups themselves.
};

/// Key of the cell that contains a block.
inline Vec3i cellOfBlock(const BlockKey& block) {
  constexpr int kShift = BlockCells::kSideLog2;
  return {block.x >> kShift, block.y >> kShift, block.z >> kShift};
}

/// Whether part of a cube of blocks may be in a frame's view. Each block is treated as a ball
/// around its centre. True whenever mayBeInView() is true for at least one of the blocks.
/// @param cube Coordinates of the cube's first block, divided by `side`.
/// @param side Number of blocks along each edge of the cube.
/// @param radius Radius of the balls, in voxels.
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
