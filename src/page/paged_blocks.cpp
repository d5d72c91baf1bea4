#include "page/paged_blocks.h"

#include <new>
#include <utility>

namespace dtsdf {
namespace {

size_t isMarked(const PagedBlock& block) { return block.dirty || block.painted ? 1 : 0; }

}  // namespace

bool PagedBlocks::put(const PagedBlock& block, RecordBytes record) try {
  if (free_numbers_.empty()) {
    if (free_numbers_.capacity() <= pages_.size()) {
      free_numbers_.reserve(2 * pages_.size() + 1);  // for all: who leaves takes no memory
    }
    pages_.emplace_back();
    free_numbers_.push_back(static_cast<int32_t>(pages_.size() - 1));
  }
  const auto stored = store_.write(std::move(record));
  if (!stored) return false;
  const int32_t number = free_numbers_.back();
  if (!enter(block.block.key, number)) {
    store_.erase(*stored);
    return false;
  }
  pages_[static_cast<size_t>(number)] = {block, *stored};
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
  const Page& gone = page(number);
  store_.erase(gone.record);
  index_.erase(keyOf(number));
  cells_.erase(gone.block.block.key, number);
  marked_ -= isMarked(gone.block);
  free_numbers_.push_back(number);
}

void PagedBlocks::setMarks(int32_t number, bool dirty, bool painted) {
  PagedBlock& block = pages_[static_cast<size_t>(number)].block;
  marked_ -= isMarked(block);
  block.dirty = dirty;
  block.painted = painted;
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
  pages_.clear();
  free_numbers_.clear();
  marked_ = 0;
}

size_t PagedBlocks::indexBytes() const {
  return index_.memoryBytes() + cells_.memoryBytes() + pages_.capacity() * sizeof(Page) +
         free_numbers_.capacity() * sizeof(int32_t);
}

}  // namespace dtsdf
