/// The index of the map: which blocks, voxel arrays and bricks of colours there are, where they
/// live, and what they may cost. Both backends keep their books here, so that both admit and
/// recycle the same blocks.
#pragma once

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
  bool is_vacant;        ///< Returned by the next takeVacant(), or just now.
  uint32_t extractions;  ///< Begun before the block was made.
};

/// Directions that a block has arrays of, a bit each.
inline uint32_t directionsWithArrays(const BlockEntry& entry) {
  uint32_t directions = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    directions |= static_cast<uint32_t>(entry.array[d] != kNoArray) << d;
  }
  return directions;
}

/// Squared distance of a point from the nearest one of a block, in voxels^2.
double squaredDistance(const BlockKey& block, const Vec3d& p);

/// A block that a frame wants to write to, and in which directions (bit d for direction d).
struct BlockRequest {
  PackedKey key;
  uint32_t directions;
};

/// A block of which something is painted: bit kBricksPerArray * d + b for brick b of direction d.
struct ColourRequest {
  PackedKey key;
  uint64_t bricks;
};
static_assert(kBricksPerArray * kDirectionCount <= 64, "a bit for each brick of a block");

/// A brick of colours that a voxel array has got.
struct NewBrick {
  int32_t array, brick;
  int32_t colours;  ///< Number of the brick among all; its memory is to be zeroed.
};

/// Outcome of BlockTable::admit(), or of admitColours().
struct Admission {
  std::vector<int32_t> changed_slots;  ///< Blocks that are new or got new arrays, in key order.
  std::vector<int32_t> new_arrays;     ///< Arrays that were assigned; their memory is to be zeroed.
  std::vector<NewBrick> bricks;        ///< In the order of keys.
  size_t refused = 0;                  ///< Requests, or bricks, beyond the budget.
};

/// Sizes of the pools of slots and arrays.
struct PoolSizes {
  size_t slots, arrays;
};

/// A block of which arrays (bit d for direction d) hold nothing: new ones that turned out so, and
/// those that a frame emptied.
struct EmptyBlock {
  int32_t slot;
  uint32_t directions;
};

/// What a block lost in a region.
struct EmptiedBlock {
  uint32_t voxels;            ///< That held something.
  uint32_t empty_directions;  ///< Bit d: the array of direction d was emptied.
};

class BlockTable {
 public:
  /// Bytes that a voxel array and a block count towards the budget.
  static constexpr size_t kArrayBytes = kVoxelsPerBlock * sizeof(Voxel);
  static constexpr size_t kBlockBytes = 2 * kVoxelsPerBlock + 64;  // labels of units, entry, hash
  /// Bytes of a brick of colours, which a voxel array has once something in it is painted.
  static constexpr size_t kColourBytes = kVoxelsPerBrick * sizeof(VoxelColour);

  explicit BlockTable(size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// From now on only blocks of this extent are made, and painted. Requests for others are passed
  /// over, and not refused. It outlasts clear().
  void restrictTo(const MapExtent& extent) { extent_ = extent; }
  bool takesColour(const BlockKey& key) const { return extent_.painted.contains(key); }
  const BlockExtent& paintedExtent() const { return extent_.painted; }

  /// Slot of a block, or -1.
  int32_t find(PackedKey key) const { return slots_.find(key); }
  const BlockEntry& block(int32_t slot) const { return blocks_[slot]; }

  /// One more than the largest slot or array index in use so far: the size that pools must have.
  size_t slotCount() const { return blocks_.size(); }
  size_t arrayCount() const { return array_count_; }
  size_t colourCount() const { return colour_count_; }

  /// Makes the requested blocks and arrays, smallest key first whatever the order given, as long as
  /// the budget lasts. A request is admitted whole or refused whole.
  Admission admit(std::vector<BlockRequest> requests);

  /// Admits them in the same way where a device waits for it: nothing finds the new blocks by their
  /// keys or in view before publish(), which takes as long again.
  Admission allocate(std::vector<BlockRequest> requests);
  void publish();

  /// Gives bricks of colours to voxel arrays that lack them, smallest key first, as long as the
  /// budget lasts. What is not in the map, or takes no colour, is passed over.
  Admission admitColours(std::vector<ColourRequest> requests);

  /// Bricks that requests want beyond what is there, at most.
  size_t countNewColours(const std::vector<ColourRequest>& requests) const;

  /// The number of a voxel array's brick of colours, or kNoArray. It goes with the voxel array.
  int32_t colourOf(int32_t array, int brick) const {
    const size_t place = static_cast<size_t>(array) * kBricksPerArray + brick;
    return place < colour_of_.size() ? colour_of_[place] : kNoArray;
  }

  /// What the pools will not exceed after an admission of so many blocks and arrays. To be taken
  /// before it, so that nothing that follows the admission can fail for want of memory.
  PoolSizes sizesAfter(size_t new_blocks, size_t new_arrays) const;

  /// Blocks and arrays that requests want beyond what is there; those that come twice count twice.
  PoolSizes countNew(const std::vector<BlockRequest>& requests) const;

  /// Releases arrays of a block (bit d for direction d), and with the last of them the block.
  /// @return whether the block has gone.
  bool release(int32_t slot, uint32_t directions);

  /// Releases arrays of a block that held something. The block itself stays, since a mesh of it may
  /// be shown; takeUnseen() or takeVacant() returns it then.
  /// @return whether it has none now.
  bool vacate(int32_t slot, uint32_t directions);

  /// An extraction of meshes begins, of all blocks that there are.
  void noteExtraction() { ++extractions_; }
  uint32_t extractions() const { return extractions_; }  ///< Begun so far.

  /// The block was made when so many had begun: it is back from elsewhere.
  void setExtractions(int32_t slot, uint32_t extractions) {
    blocks_[static_cast<size_t>(slot)].extractions = extractions;
  }

  /// Blocks that have lost their last array since the last call and that no extraction has met:
  /// nobody has to learn that they are gone.
  std::vector<int32_t> takeUnseen() { return std::exchange(unseen_, {}); }

  /// Blocks that have lost their last array since the last call. They are still in the table: what
  /// shows a mesh of them has to learn first that it is gone.
  std::vector<int32_t> takeVacant();

  /// Blocks with arrays that may have voxels in a region in units of voxels, by slot.
  std::vector<int32_t> slotsIn(const RegionView& region) const;

  /// Blocks of which a frame may see something within so many voxels of their middle, in no order:
  /// all of those, and others around. Costs what is in view, however large the map is.
  std::vector<int32_t> slotsInView(const FrameView& frame, float radius) const;

  /// Blocks by coarse cells, and when they were needed: see BlockCells.
  const std::vector<BlockCells::Cell>& cells() const { return cells_.all(); }
  template <class Visit>
  void visitCellsInView(const FrameView& frame, float radius, const Visit& visit) const {
    cells_.visitInView(frame, radius, visit);
  }
  void noteNeed(const BlockKey& block, uint64_t time) { cells_.note(block, time); }

  /// Blocks with arrays that lie wholly outside a ball, in no order.
  std::vector<int32_t> slotsBeyond(const RegionView& kept) const;

  /// Releases those blocks of a list that have no arrays. @return them.
  std::vector<int32_t> releaseVacant(const std::vector<int32_t>& slots);

  void clear();

  /// Slots of all blocks, by packed key.
  std::vector<int32_t> sortedSlots() const;

  size_t blocksInUse() const { return slots_.size() + unlisted_.size(); }
  size_t arraysInUse() const { return arrays_in_use_; }
  size_t coloursInUse() const { return colours_in_use_; }
  size_t bytesInUse() const {
    return blocksInUse() * kBlockBytes + arrays_in_use_ * kArrayBytes +
           colours_in_use_ * kColourBytes;
  }
  size_t bytesPeak() const { return bytes_peak_; }  ///< The most that were in use.
  size_t budgetBytes() const { return budget_bytes_; }
  void setBudget(size_t bytes) { budget_bytes_ = bytes; }

  /// Bytes that a block counts towards the budget.
  size_t bytesOf(int32_t slot) const;

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
  void visitLacking(const std::vector<ColourRequest>& requests, const Visit& visit) const;
  bool releaseArrays(int32_t slot, uint32_t directions);
  void releaseBlock(int32_t slot);
  int32_t makeColour(int32_t array, int brick);
  void releaseColours(int32_t array);
  uint32_t lackedDirections(const BlockRequest& request, int32_t slot) const;
  template <class Request>
  std::vector<int32_t> findAll(const std::vector<Request>& requests) const;
  int32_t makeBlock(PackedKey key);

  size_t budget_bytes_;
  MapExtent extent_;
  SlotIndex slots_;
  BlockCells cells_;
  std::deque<BlockEntry> blocks_;  ///< Indexed by slot; it grows without moving what is there.
  std::vector<int32_t> unlisted_;  ///< New blocks that are not in slots_ and cells_ yet.
  std::vector<int32_t> free_slots_, free_arrays_;
  std::vector<int32_t> vacant_;  ///< May have got arrays again since.
  std::vector<int32_t> unseen_;  ///< Those of them that are in no mesh.
  uint32_t extractions_ = 0;
  size_t array_count_ = 0, arrays_in_use_ = 0;
  std::vector<int32_t> colour_of_;  ///< Indexed by voxel array and brick; empty until painted.
  std::vector<int32_t> free_colours_;
  size_t colour_count_ = 0, colours_in_use_ = 0;
  size_t bytes_peak_ = 0;
};

}  // namespace dtsdf
