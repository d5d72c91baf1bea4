/// The blocks of a map that lie on disk: an index of them in memory, and what they hold in a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "map/block_cells.h"
#include "map/mesh_state.h"
#include "map/slot_index.h"
#include "page/record_store.h"

namespace dtsdf {

/// What is known of a block on disk without reading it.
struct PagedBlock {
  MapBlock block;
  uint32_t extractions;      ///< Of its BlockEntry.
  MeshState mesh;            ///< Its labels lie behind its voxels and colours.
  StoredRecord record = {};  ///< Where what it holds lies, once it is put there.
};

/// By numbers, which a block keeps as long as it is there.
class PagedBlocks {
 public:
  /// @throws std::runtime_error where the folder cannot be written.
  PagedBlocks(const std::string& folder, uint64_t max_bytes, size_t most_waiting)
      : store_(folder, max_bytes, most_waiting) {}

  /// @return whether it is there now: the store took it, and there was memory for it.
  bool put(const PagedBlock& block, RecordBytes record);
  /// Any thread may.
  RecordStore::Reading read(int32_t number, std::vector<char>& record) {
    return store_.read(block(number).record, record);
  }
  void readAhead(int32_t number) const { store_.readAhead(block(number).record); }
  void erase(int32_t number);
  void clear();

  /// Number of a block, or -1.
  int32_t find(PackedKey key) const { return index_.find(key); }
  const PagedBlock& block(int32_t number) const { return blocks_[static_cast<size_t>(number)]; }
  PackedKey keyOf(int32_t number) const { return packKey(block(number).block.key); }
  bool isEmpty() const { return index_.size() == 0; }
  size_t count() const { return index_.size(); }

  /// Marks of a block for the next extraction, and how many blocks have any.
  void setMarks(int32_t number, const MeshMarks& marks);
  size_t marked() const { return marked_; }

  /// Keys of blocks that something holds for, in no order: by coarse cells, then one by one.
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
  /// All in coarse cells that a frame may see something of, and that are asked for.
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
  std::vector<PackedKey> keysInCells(const std::unordered_set<PackedKey>& cells) const;

  RecordStore& store() { return store_; }
  const RecordStore& store() const { return store_; }
  size_t indexBytes() const;

 private:
  bool enter(const BlockKey& key, int32_t number);

  RecordStore store_;
  SlotIndex index_;
  BlockCells cells_;
  std::vector<PagedBlock> blocks_;  ///< By number.
  std::vector<int32_t> free_numbers_;
  size_t marked_ = 0;
};

}  // namespace dtsdf
