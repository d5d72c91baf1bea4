/// The blocks of a map that lie on disk: an index of them in memory, and what they hold in a file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "map/block_cells.h"
#include "map/block_table.h"
#include "map/record_bytes.h"
#include "map/slot_index.h"
#include "page/free_runs.h"
#include "page/page_file.h"
#include "page/page_queue.h"
#include "threads/parallel.h"

namespace dtsdf {

/// What is known of a block on disk without reading it.
struct PagedBlock {
  PackedKey key;
  uint64_t bricks;                ///< Bit 8 d + b: brick b of direction d has colours.
  uint32_t extractions;           ///< Of its BlockEntry.
  uint8_t directions;             ///< Bit d: it has voxels of direction d.
  bool has_labels;                ///< Labels of its units lie behind its voxels and colours.
  bool dirty, painted, has_mesh;  ///< As meshing left it.
};

inline bool isMarked(const PagedBlock& block) { return block.dirty || block.painted; }

/// Bytes of a block's voxels, colours and labels, one after the other.
size_t recordBytes(const PagedBlock& block);

/// Calls visit(i, begin) for each block, on some threads: where its record begins.
template <class Visit>
void forEachRecord(const std::vector<PagedBlock>& blocks, const Visit& visit) {
  constexpr size_t kAtOnce = 256;
  constexpr int kThreads = 4;
  std::vector<size_t> begins(blocks.size());
  for (size_t i = 1; i < blocks.size(); ++i) {
    begins[i] = begins[i - 1] + recordBytes(blocks[i - 1]);
  }
  parallelFor((blocks.size() + kAtOnce - 1) / kAtOnce, kThreads, [&](size_t part) {
    const size_t end = std::min(blocks.size(), (part + 1) * kAtOnce);
    for (size_t i = part * kAtOnce; i < end; ++i) visit(i, begins[i]);
  });
}

/// What came of reading a block.
enum PageReading : uint8_t {
  kPageDamaged,    ///< It is not what was written, or the file ends before it.
  kPageIntact,     ///< It is what was written.
  kPageUnreadable  ///< The disk did not give it; it may the next time.
};

class PageStore {
 public:
  /// @param queue_bytes See PageQueue.
  /// @throws std::runtime_error where the folder cannot be written.
  PageStore(const std::string& folder, uint64_t max_bytes, size_t queue_bytes);

  /// How much more may be written. An eighth of the space, at most 32 MiB, is a reserve for what
  /// makes room for blocks that come back: a full disk would hold on to these else.
  uint64_t room(bool with_reserve) const;

  /// Whether so much more may be written; else problem() says why.
  bool hasRoomFor(uint64_t bytes, bool with_reserve);

  /// Whether there was no room, and nothing was released since: it need not be tried again.
  bool isFull(bool with_reserve) const { return is_full_[with_reserve ? 1 : 0]; }

  /// Takes blocks, which hold what lies in `records` back to back: they are written while others
  /// go on. @return whether it did; else nothing has changed, and problem() says why.
  bool write(const std::vector<PagedBlock>& blocks, const SharedRecords& records);

  /// Reads what blocks hold, back to back, by their numbers; they stay where they are.
  /// @return a PageReading for each.
  std::vector<uint8_t> read(const std::vector<int32_t>& numbers, PageBytes& records);

  /// The same without copies of what is in memory. @param make For what has to be read.
  std::vector<uint8_t> fetch(const std::vector<int32_t>& numbers, const RecordsMaker& make,
                             std::vector<RecordPlace>& places);

  /// Blocks that may be needed soon are read while others go on, the first ones first, as far as
  /// there is room for them.
  void readAhead(const std::vector<int32_t>& numbers, const RecordsMaker& make = makePlainRecords);

  /// How many of these blocks, the first ones, fetch() finds in memory.
  size_t countInMemory(const std::vector<int32_t>& numbers) const;

  /// Waits until all is in the file, or cannot be written, and what was asked for is read ahead.
  void finish() { queue_.finish(); }

  /// Forgets blocks, by their numbers.
  void release(const std::vector<int32_t>& numbers);
  void clear();

  /// Number of a block, or -1.
  int32_t find(PackedKey key) const { return index_.find(key); }
  bool isEmpty() const { return index_.size() == 0; }
  const PagedBlock& block(int32_t number) const { return pages_[size(number)].block; }

  /// Marks of a block for the next extraction, and how many blocks have any.
  void setMarks(int32_t number, bool dirty, bool painted);
  size_t marked() const { return marked_; }

  /// Blocks by coarse cells, by their numbers.
  const std::vector<BlockCells::Cell>& cells() const { return cells_.all(); }
  const BlockCells& cellIndex() const { return cells_; }
  template <class Visit>
  void visit(const Visit& visit) const {
    for (const BlockCells::Cell& cell : cells_.all()) {
      for (const int32_t number : cell.slots) visit(number, block(number));
    }
  }

  size_t count() const { return index_.size(); }
  uint64_t bytes() const;
  size_t indexBytes() const;
  /// Of memory, of blocks on their way to the file or read ahead.
  size_t queueBytes() const { return queue_.bytes(); }
  const std::string& problem() const { return problem_; }
  DiskWaits waits() const {
    return {read_waits_.count + queue_.waits().count, read_waits_.ms + queue_.waits().ms};
  }

 private:
  struct Page {
    PagedBlock block;
    uint64_t checksum;
    uint32_t first_unit;
  };

  static size_t size(int32_t number) { return static_cast<size_t>(number); }
  static PageSpan spanOf(Page& page) {
    return {offsetOf(page), recordBytes(page.block), &page.checksum};
  }
  static uint64_t offsetOf(const Page& page);
  std::vector<PageSpan> spansOf(const std::vector<int32_t>& numbers);
  std::string takeRoom(const std::vector<PagedBlock>& blocks, std::vector<Page>& pages);
  std::vector<uint8_t> readMissing(const std::vector<PageSpan>& spans, const RecordsMaker& make,
                                   std::vector<RecordPlace>& places);
  int32_t enter(const Page& page);
  void giveRoomBack(const Page& page);
  void leave(const std::vector<int32_t>& numbers);

  const uint64_t max_bytes_;
  PageFile file_;
  PageQueue queue_;
  DiskWaits read_waits_;
  FreeRuns runs_;
  SlotIndex index_;
  BlockCells cells_;
  std::deque<Page> pages_;  ///< By number; they stay where they are.
  std::vector<int32_t> free_numbers_;
  size_t marked_ = 0;
  std::string problem_;
  bool is_full_[2] = {false, false};  ///< Without and with the reserve.
};

}  // namespace dtsdf
