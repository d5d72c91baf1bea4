/// Moves blocks of a map between memory and disk. Required blocks are loaded, and the least
/// recently needed blocks are evicted to make room. A block is written with all its state, so
/// paging does not change the map.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "backend/map_backend.h"
#include "engine/mesh_parts.h"
#include "map/block_table.h"
#include "page/paged_blocks.h"

namespace dtsdf {

/// Adds blocks to a table and its backend, after reserving memory.
/// @param states The blocks' meshing states; null if the blocks are new. @return the blocks' slots.
std::vector<int32_t> addContents(const MapContents& contents, const MeshStates* states,
                                 BlockTable& table, MapBackend& backend);

class Pager {
 public:
  /// @param threads Number of threads that read blocks.
  /// @throws std::runtime_error if map/page_folder cannot be written.
  Pager(const MapperParams& params, const Rules& rules, int threads, BlockTable& table);

  bool isEmpty() const { return blocks_.isEmpty(); }
  bool isPaged(PackedKey key) const { return blocks_.find(key) >= 0; }
  /// Whether the budget has room for `bytes` without evicting anything.
  bool hasRoom(size_t bytes) const { return table_.bytesInUse() + bytes <= budget_bytes_; }
  /// Size of a block when it is in memory; 0 if it is not in the map.
  size_t bytesOf(PackedKey key) const;
  /// Whether the blocks of `keys` fit into the budget together.
  bool fits(const std::vector<PackedKey>& keys) const;
  /// Removes keys from the end until the blocks of the rest fit into the budget.
  /// @return the number of keys removed.
  size_t trim(std::vector<PackedKey>& keys) const;

  // ---- Required blocks. An extraction in progress must be fetched before blocks move.

  /// Whether any of these blocks is on disk, so that require() would read it.
  bool isAnyPaged(const std::vector<PackedKey>& keys) const;

  /// Loads blocks that are in the map, and keeps them in memory until the next call. Evicts other
  /// blocks to make room. The budget may be exceeded temporarily.
  /// @param keys Sorted by importance, as there may not be room for all if the disk is full.
  /// @return the number of blocks that stay on disk, because there is no room or reading failed.
  size_t require(MapBackend& backend, const std::vector<PackedKey>& keys);

  /// Evicts blocks, except those requested by the last require(), to free somewhat more than
  /// `bytes`. If no blocks are left to evict, the table may exceed the budget until the next call.
  /// @return whether there is room for `bytes` now.
  bool makeRoom(MapBackend& backend, size_t bytes);

  /// Keeps a block in memory, like those requested by the last require().
  void touch(int32_t slot);

  /// Keys of the blocks that a depth image touches or may clear. Empty if no block has to move,
  /// because all these blocks are in memory and there is room for new blocks.
  std::vector<PackedKey> neededKeys(MapBackend& backend, const FrameView& view,
                                    const TouchedBlocks& touched,
                                    const std::vector<int32_t>& in_view,
                                    uint64_t frame_number) const;

  /// Blocks in memory and on disk that may be in view, up to a depth, nearest first.
  std::vector<PackedKey> keysInView(const FrameView& view, float radius, float max_depth_m) const;

  /// Whether blocks on disk may be in view; checks only their coarse cells (BlockCells).
  bool mayShow(const FrameView& view, float radius) const;

  /// Blocks on disk that may be inside a region, or that lie outside a sphere.
  std::vector<PackedKey> keysIn(const RegionView& region) const;
  std::vector<PackedKey> keysBeyond(const RegionView& kept) const;

  // ---- Reading ahead.

  /// Notes that a depth image was fused. Blocks in its view stay in memory, and blocks that will
  /// come into view if the camera's motion continues are read ahead.
  void noteFrame(const DepthFrame& frame, const FrameView& view);

  /// Called between frames. Loads some of the blocks read ahead, and evicts some blocks that are
  /// out of view, so that frames seldom have to wait for either.
  void moveBetweenFrames(MapBackend& backend);

  // ---- Meshing.

  void markAll(const MeshMarks& marks);
  bool hasMarks() const { return blocks_.marked() > 0; }
  /// Marked blocks in memory and on disk. @param taken Whether to remove the marks.
  std::vector<MarkedKey> marked(MapBackend& backend, bool taken);
  /// Marks blocks in memory and on disk. Keys of blocks that are not in the map are ignored.
  void setMarks(MapBackend& backend, const std::vector<MarkedKey>& marked);

  // ---- The whole map.

  /// Removes blocks on disk from the map, and marks the blocks around them for meshing.
  void drop(MapBackend& backend, const std::vector<PackedKey>& keys);

  /// Returns empty meshes for all blocks dropped since the last call.
  MeshUpdate takeDropped();

  /// Adds the blocks on disk to the contents, and sorts all blocks by key.
  void addBlocksTo(MapContents& contents) const;

  /// Copies voxels and colours of the blocks listed in `contents` from memory and disk.
  /// Damaged blocks are filled with 0 and dropped from the map.
  /// @throws std::runtime_error if the disk cannot be read.
  void copyWords(MapBackend& backend, MapContents& contents);

  void clear();
  PageStats stats() const;

 private:
  std::vector<int32_t> numbersOf(const std::vector<PackedKey>& keys) const;
  void evict(MapBackend& backend, size_t bytes, uint64_t before);
  std::vector<int32_t> leastRecentlyNeeded(size_t bytes, uint64_t before) const;
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
  uint64_t now_ = 1;                 ///< Counts the calls to require() and noteFrame().
  uint64_t no_writes_before_ = 0;    ///< Nothing is written until now_ reaches this value.
  std::vector<uint64_t> last_need_;  ///< Per slot, the value of now_ when it was last needed.
  std::optional<Eigen::Isometry3d> T_W_C_before_;  ///< Pose of the last frame.
  std::optional<DepthFrame> ahead_of_;       ///< Frame from which to read ahead (without pixels).
  std::optional<Eigen::Isometry3d> motion_;  ///< Motion from the previous frame; none after a jump.
  std::vector<PackedKey> ahead_;             ///< Blocks read ahead; those needed first come first.
  size_t next_ahead_ = 0, blocks_per_frame_ = 0;  ///< Next in ahead_; number to load per frame.
  uint64_t kept_since_ = 0;  ///< When ahead_ was computed; blocks needed since then are kept.
  std::vector<PackedKey> dropped_;
  uint64_t frames_ = 0, written_ = 0, read_ = 0;
};

}  // namespace dtsdf
