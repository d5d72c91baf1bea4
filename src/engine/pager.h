/// Which blocks of a map are in memory, and which on disk: those that are needed come back, and
/// those that were needed least recently make room for them. What is written of a block is all that
/// belongs to it, so that the map is the one that it would be without.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_set>
#include <vector>

#include "backend/map_backend.h"
#include "engine/mesh_parts.h"
#include "map/block_table.h"
#include "page/page_store.h"

namespace dtsdf {

/// Room that is made beyond what is asked for, so that not every frame has to write; not so much
/// that the frame that does has to wait for long.
size_t spareBytes(size_t budget_bytes);

class Pager {
 public:
  /// @param finish_meshes Called before blocks move: fetches the extraction that is under way.
  /// @throws std::runtime_error where map/page_folder cannot be written.
  Pager(const MapParams& params, BlockTable& table, std::function<void()> finish_meshes);

  bool isEmpty() const { return store_.isEmpty(); }
  bool isPaged(PackedKey key) const { return store_.find(key) >= 0; }
  /// Whether so much more can be in memory as it is.
  bool hasRoom(size_t bytes) const { return table_.bytesInUse() + bytes <= table_.budgetBytes(); }

  /// Blocks that are in the map are in memory when this returns, and stay there until the next
  /// call; then there is room for so many bytes of new ones, as far as others can go.
  /// @param keys The first ones first, where there is no room for all.
  /// @return how many of the keys stay on disk for want of room, or as they cannot be read now.
  size_t bringIn(MapBackend& backend, const std::vector<PackedKey>& keys, size_t new_bytes);

  /// A depth image was fused: what it may see goes after what was seen before.
  void noteView(const FrameView& view);

  /// How many blocks are worth asking for ahead.
  size_t mostAhead() const;

  /// What may be seen soon: moveAhead() lets nothing go that readAhead() was given lately.
  void noteAhead(const FrameView& view, float radius);

  /// Blocks that may be needed soon are read while others go on, the first ones first, and come to
  /// memory with so many calls of moveAhead(); 0: only once they are needed.
  void readAhead(MapBackend& backend, std::vector<PackedKey> keys, size_t calls);

  /// Some blocks that were read ahead come to memory, and some that are out of view go, so that
  /// there is room to spare: frames then seldom have to wait for either. To be called once a frame:
  /// beside others after a mesh update, or else before the frame looks blocks up.
  void moveAhead(MapBackend& backend);

  /// Blocks that were made since are needed as those that were brought in last.
  void noteNew(const std::vector<int32_t>& slots);

  /// Others go than those that were brought in last. @return whether there is so much room now.
  bool makeRoom(MapBackend& backend, size_t bytes);

  /// Blocks on disk that something lies in, in no order: by coarse cells, then one by one.
  template <class CellTest, class Test>
  std::vector<PackedKey> keysWhere(const CellTest& may_hold, const Test& holds) const;

  /// All blocks on disk in these coarse cells, by packed keys of cells.
  std::vector<PackedKey> keysInCells(const std::unordered_set<PackedKey>& cells) const;

  /// All blocks on disk in coarse cells that a frame may see something of, and that are asked for:
  /// see BlockCells::visitInView().
  template <class CellTest>
  std::vector<PackedKey> keysInView(const FrameView& view, float radius,
                                    const CellTest& takes) const;

  /// Whether there are such cells.
  bool mayShow(const FrameView& view, float radius) const {
    bool may_show = false;
    store_.cellIndex().visitInView(view, radius, [&](const auto&) { may_show = true; });
    return may_show;
  }

  /// What a block takes in memory, wherever it is; 0 where there is none.
  size_t bytesOf(PackedKey key) const;
  /// Directions that it has voxels of.
  uint32_t directionsOf(PackedKey key) const;

  // ---- Meshing.

  void markAllDirty();
  void keepColours();                                    ///< Meshes get colours.
  bool hasMarks() const { return store_.marked() > 0; }  ///< Of blocks on disk.
  /// Blocks on disk with marks.
  std::vector<PackedKey> markedKeys() const;
  MeshMarks takeMarks(PackedKey key);
  /// Of blocks in memory or on disk; of others there are none.
  void setMarks(MapBackend& backend, const std::vector<MarkedKey>& marked);

  // ---- The map as a whole.

  /// How many of these blocks on disk, the first ones, can be dropped now: those that a mesh was
  /// extracted of take room until the next extraction.
  size_t canDrop(MapBackend& backend, const std::vector<PackedKey>& keys);

  /// Blocks that go from disk. Those that a mesh was extracted of are in memory then, without
  /// voxels. @return the slots of these.
  std::vector<int32_t> drop(MapBackend& backend, const std::vector<PackedKey>& keys);

  /// Adds blocks on disk to those of contents, by key.
  void addBlocksTo(MapContents& contents) const;

  /// Copies the voxels and colours of the contents' blocks, wherever they are. Those that are
  /// damaged are 0, counted as lost, and no longer in the map then.
  /// @throws std::runtime_error where some cannot be read now.
  void copyWords(MapBackend& backend, MapContents& contents);

  /// The same piece by piece, into the room that contents have. @pre The blocks are many.
  void copyAll(MapBackend& backend, MapContents& contents);

  /// Contents in parts that can be brought into the map one after the other.
  void visitParts(const MapContents& contents,
                  const std::function<void(const MapContents&)>& visit) const;

  void clear();
  PageStats stats() const;
  uint64_t lost() const { return stats_.lost; }
  /// Of memory, of blocks on their way.
  size_t queueBytes() const { return store_.queueBytes(); }

 private:
  enum class Reserve { kLeave, kUse };
  enum class Which { kAny, kNotAhead };

  size_t bytesOnceIn(const PagedBlock& block) const;
  uint32_t directionsInMemory(PackedKey key) const;
  bool isNeededNow(int32_t slot) const;
  void touch(int32_t slot);
  std::vector<int32_t> numbersOf(const std::vector<PackedKey>& keys) const;
  size_t readSome(MapBackend& backend, const std::vector<int32_t>& numbers);
  bool makeRoom(MapBackend& backend, size_t bytes, Reserve reserve);
  void writeOut(MapBackend& backend, size_t bytes, Reserve reserve, Which which = Which::kAny);
  std::vector<int32_t> leastRecent(size_t bytes, Which which) const;
  bool writeBatch(MapBackend& backend, const std::vector<int32_t>& slots, Reserve reserve);
  size_t readBatch(MapBackend& backend, std::vector<int32_t> numbers);
  std::vector<int32_t> readAll(const std::vector<int32_t>& numbers, PageBytes& records);
  void lose(MapBackend& backend, const std::vector<int32_t>& numbers);
  void enter(MapBackend& backend, const std::vector<PagedBlock>& blocks,
             const std::vector<ArrivingBlock>& arriving);
  std::vector<int32_t> enterWithoutVoxels(MapBackend& backend,
                                          const std::vector<PagedBlock>& blocks);

  BlockTable& table_;
  const std::function<void()> finish_meshes_;
  PageStore store_;
  uint64_t now_ = 1;  ///< Number of the last call of bringIn() or noteView().
  uint64_t no_writing_before_ =
      0;  ///< Such a number: after a failure the disk is left alone at first.
  std::vector<uint64_t> last_need_;            ///< Such a number, by slot.
  std::vector<PackedKey> ahead_;               ///< See readAhead().
  size_t next_ahead_ = 0, ahead_at_once_ = 0;  ///< Of these.
  uint64_t ahead_since_ = 0, ahead_now_ = 0;   ///< Calls of it before the last, and the last.
  PageStats stats_;
  DiskWaits waits_before_;  ///< The last clear().
};

template <class CellTest, class Test>
std::vector<PackedKey> Pager::keysWhere(const CellTest& may_hold, const Test& holds) const {
  std::vector<PackedKey> keys;
  for (const BlockCells::Cell& cell : store_.cells()) {
    if (!may_hold(cell)) continue;
    for (const int32_t number : cell.slots) {
      const PackedKey key = store_.block(number).key;
      if (holds(unpackKey(key))) keys.push_back(key);
    }
  }
  return keys;
}

template <class CellTest>
std::vector<PackedKey> Pager::keysInView(const FrameView& view, float radius,
                                         const CellTest& takes) const {
  std::vector<PackedKey> keys;
  store_.cellIndex().visitInView(view, radius, [&](const BlockCells::Cell& cell) {
    if (!takes(cell)) return;
    for (const int32_t number : cell.slots) keys.push_back(store_.block(number).key);
  });
  return keys;
}

}  // namespace dtsdf
