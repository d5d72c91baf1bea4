/// The blocks of a map that are on disk: an index in memory, and their contents in a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "map/block_cells.h"
#include "map/mesh_state.h"
#include "map/slot_index.h"
#include "page/record_store.h"

namespace dtsdf {

/// The part of a block on disk that is kept in memory.
struct PagedBlock {
  MapBlock block;
  uint32_t extractions;      ///< As in BlockEntry.
  MeshState mesh;            ///< The labels are in the record, after voxels and colours.
  StoredRecord record = {};  ///< Place of the block's contents, set by put().
};

inline size_t isMarked(const PagedBlock& block) { return block.mesh.marks.any() ? 1 : 0; }

/// Blocks on disk. A block keeps the same number while it is on disk.
class PagedBlocks {
 public:
  /// @throws std::runtime_error if the folder cannot be written.
  PagedBlocks(const std::string& folder, uint64_t max_bytes, size_t max_waiting)
      : store_(folder, max_bytes, max_waiting) {}

  /// Adds a block. @return whether the store accepted it.
  bool put(const PagedBlock& block, RecordBytes record) {
    const auto stored = store_.write(std::move(record));
    if (!stored) return false;
    if (free_numbers_.empty()) {
      free_numbers_.push_back(static_cast<int32_t>(blocks_.size()));
      blocks_.emplace_back();
    }
    const int32_t number = free_numbers_.back();
    free_numbers_.pop_back();
    cells_.insert(block.block.key, number);
    index_.insert(packKey(block.block.key), number);
    PagedBlock& put = blocks_[static_cast<size_t>(number)] = block;
    put.record = *stored;
    marked_ += isMarked(block);
    return true;
  }

  /// Several threads may call this at once, as long as none of them changes the blocks.
  RecordStore::Reading read(int32_t number, std::vector<char>& record) {
    return store_.read(block(number).record, record);
  }

  void readAhead(int32_t number) const { store_.readAhead(block(number).record); }
  void erase(int32_t number) {
    const PagedBlock& gone = block(number);
    store_.erase(gone.record);
    index_.erase(keyOf(number));
    cells_.erase(gone.block.key, number);
    marked_ -= isMarked(gone);
    free_numbers_.push_back(number);
  }

  void clear() {
    store_.clear();
    store_.resetCounts();
    index_.clear();
    cells_.clear();
    blocks_.clear();
    free_numbers_.clear();
    marked_ = 0;
  }

  /// The number of a block; -1 if it is not on disk.
  int32_t find(PackedKey key) const { return index_.find(key); }
  const PagedBlock& block(int32_t number) const { return blocks_[static_cast<size_t>(number)]; }
  PackedKey keyOf(int32_t number) const { return packKey(block(number).block.key); }
  bool isEmpty() const { return index_.size() == 0; }
  size_t count() const { return index_.size(); }

  void setMarks(int32_t number, const MeshMarks& marks) {
    PagedBlock& block = blocks_[static_cast<size_t>(number)];
    marked_ -= isMarked(block);
    block.mesh.marks = marks;
    marked_ += isMarked(block);
  }

  size_t marked() const { return marked_; }  ///< Number of blocks to be remeshed.

  /// Keys of the blocks for which holds(number) is true, in no particular order. Searches only
  /// coarse cells (see BlockCells) for which may_hold(cell) is true.
  template <class CellTest, class Test>
  std::vector<PackedKey> keysWhere(const CellTest& may_hold, const Test& holds) const {
    std::vector<PackedKey> keys;
    for (const BlockCells::Cell& cell : cells_.all()) {
      if (!may_hold(cell)) continue;
      for (const int32_t number : cell.slots) {
        if (holds(number)) keys.push_back(keyOf(number));
      }
    }
    return keys;
  }

  /// Keys of all blocks in the coarse cells that may be in a frame's view and for which takes(cell)
  /// is true.
  template <class CellTest>
  std::vector<PackedKey> keysInView(const FrameView& view, float radius,
                                    const CellTest& takes) const {
    std::vector<PackedKey> keys;
    cells_.visitInView(view, radius, [&](const BlockCells::Cell& cell) {
      if (!takes(cell)) return;
      for (const int32_t number : cell.slots) keys.push_back(keyOf(number));
    });
    return keys;
  }

  RecordStore& store() { return store_; }
  const RecordStore& store() const { return store_; }
  size_t indexBytes() const {
    return index_.memoryBytes() + cells_.memoryBytes() + blocks_.capacity() * sizeof(PagedBlock) +
           free_numbers_.capacity() * sizeof(int32_t);
  }

 private:
  RecordStore store_;
  SlotIndex index_;
  BlockCells cells_;
  std::vector<PagedBlock> blocks_;  ///< Indexed by number.
  std::vector<int32_t> free_numbers_;
  size_t marked_ = 0;
};

}  // namespace dtsdf
