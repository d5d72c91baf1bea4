// The order in which blocks leave memory.
#include <algorithm>

#include "engine/pager.h"
#include "kernels/core/direction.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {

bool Pager::isNeededNow(int32_t slot) const {
  const auto place = static_cast<size_t>(slot);
  return place < last_need_.size() && last_need_[place] == now_;
}

void Pager::touch(int32_t slot) {
  const auto place = static_cast<size_t>(slot);
  if (last_need_.size() <= place) last_need_.resize(table_.slotCount(), 0);
  last_need_[place] = now_;
  table_.noteNeed(table_.block(slot).key, now_);
}

void Pager::noteView(const FrameView& view) {
  ++now_;
  const BlockKey origin = blockOfVoxel(view.origin_voxel);
  for (const BlockCells::Cell& cell : table_.cells()) {
    if (!mayBeInView(view, cell, kFootRadius)) continue;
    const auto seen = std::find_if(cell.slots.begin(), cell.slots.end(), [&](int32_t slot) {
      return mayBeInView(view, table_.block(slot).key - origin);
    });
    if (seen != cell.slots.end()) table_.noteNeed(table_.block(*seen).key, now_);
  }
}

void Pager::noteAhead(const FrameView& view, float radius) {
  table_.visitCellsInView(view, radius, [this](const BlockCells::Cell& cell) {
    table_.noteNeed(table_.block(cell.slots.front()).key, now_);
  });
}

/// Blocks that were not brought in last, at least so many bytes of them if there are: coarse cell
/// by coarse cell, those that were needed least recently first, by key those of the same time.
std::vector<int32_t> Pager::leastRecent(size_t bytes, Which which) const {
  const uint64_t lately = ahead_since_ == 0 ? now_ : ahead_since_;
  std::vector<const BlockCells::Cell*> cells;
  for (const BlockCells::Cell& cell : table_.cells()) {
    if (which == Which::kAny || cell.last_need < lately) cells.push_back(&cell);
  }
  std::sort(cells.begin(), cells.end(), [](const auto* a, const auto* b) {
    return a->last_need != b->last_need ? a->last_need < b->last_need
                                        : packKey(a->key) < packKey(b->key);
  });
  std::vector<int32_t> slots;
  size_t found = 0;
  for (const BlockCells::Cell* cell : cells) {
    for (const int32_t slot : cell->slots) {
      if (found >= bytes) return slots;
      if (isNeededNow(slot) || directionsWithArrays(table_.block(slot)) == 0) continue;
      found += table_.bytesOf(slot);
      slots.push_back(slot);
    }
  }
  return slots;
}

}  // namespace dtsdf
