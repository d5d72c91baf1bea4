/// Index of the map: its blocks, voxel arrays and colour bricks, their locations in memory and the
/// memory budget. Both backends use it, so they admit and recycle the same blocks.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "kernels/core/direction.h"
#include "kernels/core/grid.h"
#include "kernels/core/region.h"
#include "kernels/core/voxel.h"
#include "kernels/core/voxel_colour.h"
#include "map/block_cells.h"
#include "map/block_extent.h"
#include "map/slot_index.h"

namespace dtsdf {

constexpr int32_t kNoArray = -1;

/// A block: its key and the index of its voxel array per direction, or kNoArray.
struct BlockEntry {
  BlockKey key;
  int32_t array[kDirectionCount];
  bool in_use;
  bool is_vacant;        ///< Whether it lost its last array in vacate() but is not released yet.
  uint32_t extractions;  ///< Number of mesh extractions begun before its creation.
};

/// Directions for which a block has arrays: bit d for direction d.
inline uint32_t directionsWithArrays(const BlockEntry& entry) {
  uint32_t directions = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    directions |= static_cast<uint32_t>(entry.array[d] != kNoArray) << d;
  }
  return directions;
}

/// Squared distance from a point to a block, in voxels^2; 0 inside.
double squaredDistance(const BlockKey& block, const Vec3d& p);

/// A block that a frame writes to, and its directions (bit d for direction d).
struct BlockRequest {
  PackedKey key;
  uint32_t directions;
};

/// A block to be painted, and its bricks: bit kBricksPerArray * d + b for brick b of direction d.
struct ColourRequest {
  PackedKey key;
  uint64_t bricks;
};
static_assert(kBricksPerArray * kDirectionCount <= 64, "one bit for each brick of a block");

/// A new colour brick in a voxel array.
struct NewBrick {
  int32_t array, brick;
  int32_t colours;  ///< Index in the pool of bricks; the caller zeroes its memory.
};

/// Outcome of BlockTable::admit() or admitColours().
struct Admission {
  std::vector<int32_t> changed_slots;  ///< Blocks that are new or got new arrays, in key order.
  std::vector<int32_t> new_arrays;     ///< New arrays; the caller zeroes their memory.
  std::vector<NewBrick> bricks;        ///< New bricks, in key order.
  size_t refused = 0;                  ///< Requests, or bricks, that exceed the budget.
};

/// Sizes of the pools of slots and arrays.
struct PoolSizes {
  size_t slots, arrays;
};

/// Arrays of a block (bit d for direction d) that are empty: a frame either cleared all their
/// voxels, or wrote nothing to them after they were allocated for it.
struct EmptyBlock {
  int32_t slot;
  uint32_t directions;
};

/// Effect of clearing a region on one block.
struct EmptiedBlock {
  uint32_t voxels;            ///< Number of cleared voxels that were not empty.
  uint32_t empty_directions;  ///< Bit d: the array of direction d became empty.
};

class BlockTable {
 public:
  /// Bytes of the budget used by a voxel array, and by a block without its arrays.
  static constexpr size_t kArrayBytes = kVoxelsPerBlock * sizeof(Voxel);
  static constexpr size_t kBlockBytes = 2 * kVoxelsPerBlock + 64;  // labels of units, entry, hash
  /// Bytes of the budget used by a colour brick; a brick is allocated when it is first painted.
  static constexpr size_t kColourBytes = kVoxelsPerBrick * sizeof(VoxelColour);

  explicit BlockTable(size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// Restricts new blocks and painting to an extent, even after clear(). Requests outside the
  /// extent are ignored and do not count as refused.
  void restrictTo(const MapExtent& extent) { extent_ = extent; }
  bool takesColour(const BlockKey& key) const { return extent_.painted.contains(key); }
  const BlockExtent& paintedExtent() const { return extent_.painted; }

  /// Slot of a block, or -1.
  int32_t find(PackedKey key) const { return slots_.find(key); }
  const BlockEntry& block(int32_t slot) const { return blocks_[slot]; }

  /// Sizes that the pools need: one more than the largest index used so far.
  size_t slotCount() const { return blocks_.size(); }
  size_t arrayCount() const { return array_count_; }
  size_t colourCount() const { return colour_count_; }

  /// Creates the requested blocks and arrays in the order of their keys. A request that exceeds the
  /// budget is refused as a whole.
  Admission admit(std::vector<BlockRequest> requests);

  /// The two halves of admit(). Work on the device can begin after allocate(), but find() and
  /// slotsInView() return new blocks only after publish().
  Admission allocate(std::vector<BlockRequest> requests);
  void publish();

  /// Creates the requested colour bricks in ascending order of keys, until the budget is exhausted.
  /// Blocks that are not in the map or must not be painted are ignored.
  Admission admitColours(std::vector<ColourRequest> requests);

  /// Upper bound on the number of bricks that admitColours() would create.
  size_t countNewColours(const std::vector<ColourRequest>& requests) const;

  /// Pool index of a voxel array's colour brick, or kNoArray. The brick is released with the voxel
  /// array.
  int32_t colourOf(int32_t array, int brick) const {
    const size_t place = static_cast<size_t>(array) * kBricksPerArray + brick;
    return place < colour_of_.size() ? colour_of_[place] : kNoArray;
  }

  /// Upper bound on the pools' sizes after this many blocks and arrays are admitted. Reserve this
  /// memory before admitting them, so that nothing can fail afterwards.
  PoolSizes sizesAfter(size_t new_blocks, size_t new_arrays) const;

  /// Numbers of blocks and arrays that requests would add; duplicate requests count twice.
  PoolSizes countNew(const std::vector<BlockRequest>& requests) const;

  /// Releases arrays of a block (bit d for direction d), and the block itself once it has no arrays
  /// left.
  /// @return whether the block was released.
  bool release(int32_t slot, uint32_t directions);

  /// Releases arrays of a block, but keeps the block itself, since it may have a mesh. Once the
  /// block has no arrays left, takeUnmeshed() or takeVacant() returns it.
  /// @return whether the block has no arrays left.
  bool vacate(int32_t slot, uint32_t directions);

  /// Notes that a mesh extraction begins.
  void noteExtraction() { ++extractions_; }
  uint32_t extractions() const { return extractions_; }  ///< Number of extractions so far.

  /// Restores BlockEntry::extractions of a block that was read back from disk.
  void setExtractions(int32_t slot, uint32_t extractions) {
    blocks_[static_cast<size_t>(slot)].extractions = extractions;
  }

  /// Blocks that lost their last array since the last call and have not been in any mesh
  /// extraction. They have no mesh, so they can be released before the next mesh update.
  std::vector<int32_t> takeUnmeshed() { return std::exchange(unmeshed_, {}); }

  /// Blocks that lost their last array since the last call. They stay in the table until a mesh
  /// update has reported that their meshes are gone.
  std::vector<int32_t> takeVacant();

  /// Blocks with arrays that may have voxels in a region (given in voxels), in the order of their
  /// slots.
  std::vector<int32_t> slotsIn(const RegionView& region) const;

  /// Blocks in a frame's view, each treated as a ball with a radius of `radius` voxels, and some
  /// blocks near them, in no particular order. The running time depends mostly on the number of
  /// blocks in view, not on the size of the map.
  std::vector<int32_t> slotsInView(const FrameView& frame, float radius) const;

  /// Coarse cells of blocks, and when they were last needed; see BlockCells.
  const std::vector<BlockCells::Cell>& cells() const { return cells_.all(); }
  template <class Visit>
  void visitCellsInView(const FrameView& frame, float radius, const Visit& visit) const {
    cells_.visitInView(frame, radius, visit);
  }
  void noteNeed(const BlockKey& block, uint64_t time) { cells_.note(block, time); }

  /// Blocks with arrays that lie entirely outside a ball, in no particular order.
  std::vector<int32_t> slotsBeyond(const RegionView& kept) const;

  /// Releases those of the given blocks that have no arrays. @return the slots of the released
  /// blocks.
  std::vector<int32_t> releaseVacant(const std::vector<int32_t>& slots);

  void clear();

  /// Slots of all blocks, in ascending order of packed keys.
  std::vector<int32_t> sortedSlots() const;

  size_t blocksInUse() const { return slots_.size() + unpublished_.size(); }
  size_t arraysInUse() const { return arrays_in_use_; }
  size_t coloursInUse() const { return colours_in_use_; }
  size_t bytesInUse() const {
    return blocksInUse() * kBlockBytes + arrays_in_use_ * kArrayBytes +
           colours_in_use_ * kColourBytes;
  }
  size_t bytesPeak() const { return bytes_peak_; }  ///< Maximum of bytesInUse() so far.
  size_t budgetBytes() const { return budget_bytes_; }
  void setBudget(size_t bytes) { budget_bytes_ = bytes; }

  /// Bytes of the budget used by a block with its arrays and colours.
  size_t bytesOf(int32_t slot) const;

  /// Unused bytes of the memory reserved for voxels and colours.
  size_t spareOf(size_t reserved_bytes) const {
    return reserved_bytes - std::min(reserved_bytes, bytesInUse() - blocksInUse() * kBlockBytes);
  }

  /// Memory of the table itself.
  size_t memoryBytes() const {
    return slots_.memoryBytes() + cells_.memoryBytes() + blocks_.size() * sizeof(BlockEntry) +
           (free_slots_.capacity() + free_arrays_.capacity() + colour_of_.capacity() +
            free_colours_.capacity()) *
               sizeof(int32_t);
  }

 private:
  bool hasArrays(int32_t slot) const { return directionsWithArrays(blocks_[slot]) != 0; }
  template <class Visit>
  void visitMissing(const std::vector<ColourRequest>& requests, const Visit& visit) const;
  bool releaseArrays(int32_t slot, uint32_t directions);
  void releaseBlock(int32_t slot);
  int32_t makeColour(int32_t array, int brick);
  void releaseColours(int32_t array);
  uint32_t missingDirections(const BlockRequest& request, int32_t slot) const;
  template <class Request>
  std::vector<int32_t> findAll(const std::vector<Request>& requests) const;
  int32_t makeBlock(PackedKey key);

  size_t budget_bytes_;
  MapExtent extent_;
  SlotIndex slots_;
  BlockCells cells_;
  std::deque<BlockEntry> blocks_;     ///< Indexed by slot; growing does not move entries.
  std::vector<int32_t> unpublished_;  ///< New blocks that are not in slots_ and cells_ yet.
  std::vector<int32_t> free_slots_, free_arrays_;
  std::vector<int32_t> vacant_;  ///< Blocks that lost their last array; some may have arrays again.
  /// Like vacant_, but for blocks that have not been in any mesh extraction.
  std::vector<int32_t> unmeshed_;
  uint32_t extractions_ = 0;
  size_t array_count_ = 0, arrays_in_use_ = 0;
  std::vector<int32_t> colour_of_;  ///< Indexed by voxel array and brick; empty until painted.
  std::vector<int32_t> free_colours_;
  size_t colour_count_ = 0, colours_in_use_ = 0;
  size_t bytes_peak_ = 0;
};

}  // namespace dtsdf
