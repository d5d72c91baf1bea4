#include "page/paged_blocks.h"

#include <new>
#include <utility>

namespace dtsdf {
namespace {

size_t isMarked(const PagedBlock& block) { return block.mesh.marks.any() ? 1 : 0; }

}  // namespace

bool PagedBlocks::put(const PagedBlock& block, RecordBytes record) try {
  if (free_numbers_.empty()) {
    if (free_numbers_.capacity() <= blocks_.size()) {
      free_numbers_.reserve(2 * blocks_.size() + 1);  // for all: who leaves takes no memory
    }
    blocks_.emplace_back();
    free_numbers_.push_back(static_cast<int32_t>(blocks_.size() - 1));
  }
  const auto stored = store_.write(std::move(record));
  if (!stored) return false;
  const int32_t number = free_numbers_.back();
  if (!enter(block.block.key, number)) {
    store_.erase(*stored);
    return false;
  }
  PagedBlock& put = blocks_[static_cast<size_t>(number)] = block;
  put.record = *stored;
  free_numbers_.pop_back();
  marked_ += isMarked(block);
  return true;
} catch (const std::bad_alloc&) {
  store_.fail("out of memory");
  return false;
}

/// @return whether there was memory for it; else nothing has changed.
bool PagedBlocks::enter(const BlockKey& key, int32_t number) try {
  cells_.insert(key, number);
  try {
    index_.insert(packKey(key), number);
  } catch (const std::bad_alloc&) {
    cells_.erase(key, number);
    throw;
  }
  return true;
} catch (const std::bad_alloc&) {
  store_.fail("out of memory");
  return false;
}

void PagedBlocks::erase(int32_t number) {
  const PagedBlock& gone = block(number);
  store_.erase(gone.record);
  index_.erase(keyOf(number));
  cells_.erase(gone.block.key, number);
  marked_ -= isMarked(gone);
  free_numbers_.push_back(number);
}

void PagedBlocks::setMarks(int32_t number, const MeshMarks& marks) {
  PagedBlock& block = blocks_[static_cast<size_t>(number)];
  marked_ -= isMarked(block);
  block.mesh.marks = marks;
  marked_ += isMarked(block);
}

std::vector<PackedKey> PagedBlocks::keysInCells(const std::unordered_set<PackedKey>& cells) const {
  std::vector<PackedKey> keys;
  for (const PackedKey cell_key : cells) {
    const BlockCells::Cell* const cell = cells_.find(cell_key);
    if (cell == nullptr) continue;
    for (const int32_t number : cell->slots) keys.push_back(keyOf(number));
  }
  return keys;
}

void PagedBlocks::clear() {
  store_.clear();
  store_.resetCounts();
  index_.clear();
  cells_.clear();
  blocks_.clear();
  free_numbers_.clear();
  marked_ = 0;
}

size_t PagedBlocks::indexBytes() const {
  return index_.memoryBytes() + cells_.memoryBytes() + blocks_.capacity() * sizeof(PagedBlock) +
         free_numbers_.capacity() * sizeof(int32_t);
}

}  // namespace dtsdf
