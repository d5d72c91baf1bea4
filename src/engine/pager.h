/// Which blocks of a map are in memory, and which on disk: those that are needed come back, and
/// those that were needed least recently make room for them. What is written of a block is all that
/// belongs to it, so that the map is the one that it would be without.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "backend/map_backend.h"
#include "engine/mesh_parts.h"
#include "map/block_table.h"
#include "page/paged_blocks.h"

namespace dtsdf {

/// What so many new blocks and arrays take.
size_t bytesOfNew(const PoolSizes& lack);

/// Brings blocks into a table and its backend, as a frame does: memory first, then the table, then
/// what the backend knows of it. @param states Their states of meshing; null: new.
/// @return their slots.
std::vector<int32_t> enterContents(const MapContents& contents, const MeshStates* states,
                                   BlockTable& table, MapBackend& backend);

class Pager {
 public:
  /// @throws std::runtime_error where map/page_folder cannot be written.
  /// @param threads That read.
  Pager(const MapperParams& params, const Rules& rules, int threads, BlockTable& table);

  bool isEmpty() const { return blocks_.isEmpty(); }
  bool isPaged(PackedKey key) const { return blocks_.find(key) >= 0; }
  /// Whether so much more fits into the budget as it is.
  bool hasRoom(size_t bytes) const { return table_.bytesInUse() + bytes <= budget_bytes_; }
  /// What a block takes in memory, wherever it is; 0 where there is none.
  size_t bytesOf(PackedKey key) const;
  /// Whether these fit beside so much else.
  bool fits(const std::vector<PackedKey>& keys, size_t other_bytes) const;
  /// Takes the last keys away that do not fit. @return how many.
  size_t trim(std::vector<PackedKey>& keys) const;

  // ---- What is needed. An extraction under way has to be fetched before blocks move.

  size_t countPaged(const std::vector<PackedKey>& keys) const { return numbersOf(keys).size(); }
  /// Whether require() would bring any in.
  bool isAnyPaged(const std::vector<PackedKey>& keys) const;

  /// Blocks that are in the map are in memory when this returns, and stay there until the next
  /// call; what they lack room for goes after them. @param keys The first ones first, where the
  /// disk takes nothing in exchange. @return how many of the keys stay on disk, for that or as they
  /// cannot be read now.
  size_t require(MapBackend& backend, const std::vector<PackedKey>& keys);

  /// Others go than those that were required last, some more than that. Where no others are left,
  /// the table may exceed the budget until the next call.
  /// @return whether there is so much room now.
  bool makeRoom(MapBackend& backend, size_t bytes);

  /// Blocks that were made since are needed as those that were required last.
  void noteNew(const std::vector<int32_t>& slots);

  /// What a depth image touches, and what it may clear, by key; none: all of it is in memory, with
  /// room for what is new.
  std::vector<PackedKey> neededKeys(MapBackend& backend, const FrameView& view,
                                    const TouchedBlocks& touched,
                                    const std::vector<int32_t>& in_view,
                                    uint64_t frame_number) const;

  /// Blocks in memory and on disk of which a view may show something, the nearest first.
  std::vector<PackedKey> keysInView(const FrameView& view, float radius, float max_depth_m) const;

  /// Whether a view may show something of blocks on disk, by coarse cells.
  bool mayShow(const FrameView& view, float radius) const;

  /// Blocks on disk that may be inside a region; those beyond a ball.
  std::vector<PackedKey> keysIn(const RegionView& region) const;
  std::vector<PackedKey> keysBeyond(const RegionView& kept) const;

  // ---- What comes next.

  /// A depth image was fused: what it saw stays, and what it will see if it moves on as it did is
  /// read ahead.
  void noteFrame(const DepthFrame& frame, const FrameView& view, bool has_moved_blocks);

  /// Between frames: some blocks that were read ahead come to memory, and some that are out of view
  /// go, so that there is room to spare: frames then seldom have to wait for either.
  void moveBetween(MapBackend& backend);

  // ---- Meshing.

  void markAll(const MeshMarks& marks);
  bool hasMarks() const { return blocks_.marked() > 0; }
  /// Marks of all blocks in memory and on disk. @param taken They are marked no longer.
  std::vector<MarkedKey> marked(MapBackend& backend, bool taken);
  /// Sets marks of blocks in memory or on disk, and passes over other keys.
  void setMarks(MapBackend& backend, const std::vector<MarkedKey>& marked);

  // ---- The map as a whole.

  /// Blocks on disk go from the map, and what is meshed around them is marked.
  void drop(MapBackend& backend, const std::vector<PackedKey>& keys);

  /// Blocks that were dropped or lost since the last call: as they have no mesh any more.
  MeshUpdate takeDropped();

  /// Adds blocks on disk to those of contents, by key.
  void addBlocksTo(MapContents& contents) const;

  /// Copies the voxels and colours of the contents' blocks, wherever they are. Those that are
  /// lost are 0, and no longer in the map then. @throws std::runtime_error where the disk gives
  /// nothing.
  void copyWords(MapBackend& backend, MapContents& contents);

  void clear();
  PageStats stats() const;

 private:
  std::vector<int32_t> numbersOf(const std::vector<PackedKey>& keys) const;
  void touch(int32_t slot);
  void evict(MapBackend& backend, size_t bytes, uint64_t before);
  std::vector<int32_t> leastRecent(size_t bytes, uint64_t before) const;
  bool writeBatch(MapBackend& backend, const std::vector<int32_t>& slots);
  size_t readBatch(MapBackend& backend, std::vector<int32_t> numbers);
  std::vector<PackedKey> keysAhead(DepthFrame ahead);
  std::vector<PackedKey> allPaged() const;

  const MapperParams params_;
  const FusionRules fusion_rules_;
  const int threads_;
  BlockTable& table_;
  const size_t budget_bytes_, batch_bytes_;
  PagedBlocks blocks_;
  uint64_t now_ = 1;                 ///< Number of the last call of require() or noteFrame().
  uint64_t no_writing_before_ = 0;   ///< After a failure the disk is left alone at first.
  std::vector<uint64_t> last_need_;  ///< Such a number, by slot.
  std::optional<Eigen::Isometry3d> T_W_C_before_;  ///< Pose of the last frame.
  std::optional<DepthFrame> ahead_of_;         ///< Frame to read ahead of; its image may have gone.
  std::optional<Eigen::Isometry3d> motion_;    ///< Motion from the one before; none after a jump.
  std::vector<PackedKey> ahead_;               ///< What is read ahead, the first ones first.
  size_t next_ahead_ = 0, ahead_at_once_ = 0;  ///< What of it comes next.
  uint64_t kept_since_ = 0, ahead_now_ = 0;    ///< What was needed since then does not go between.
  std::vector<PackedKey> dropped_;
  uint64_t frames_ = 0, written_ = 0, read_ = 0;
};

}  // namespace dtsdf
