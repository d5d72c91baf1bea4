/// The map on the device: a mirror of the host's BlockTable, and memory for voxels, colours and the
/// marching cubes cases of mesh units (labels).
#pragma once

#include <cstdint>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "kernels/meshing/unit_samples.h"
#include "launch.h"
#include "map/block_table.h"
#include "map/mesh_state.h"
#include "runtime/slab_pool.h"

namespace dtsdf {
namespace gpu {

/// A key that no block can have. It marks empty entries in hash tables.
constexpr PackedKey kNoKey = ~PackedKey{0};

/// A slab holds 512 voxel arrays (4 KiB each), 4096 colour bricks (4 x 4 x 4 colours, 256 bytes
/// each) or 1024 sets of unit labels (1 KiB each).
using VoxelPool = SlabPool<Voxel, kVoxelsPerBlock, 9>;
using ColourPool = SlabPool<VoxelColour, kVoxelsPerBrick, 12>;
using LabelPool = SlabPool<UnitLabels, kVoxelsPerBlock, 10>;

/// A block on the device; key is kNoKey while the slot is free.
struct SlotEntry {
  PackedKey key;
  int32_t array[kDirectionCount];
};

/// New contents of a slot, or its release.
struct SlotUpdate {
  SlotEntry entry;
  int32_t slot;
  int32_t in_use;
  int32_t dirty;  ///< Whether the block must be meshed again.
};

/// Blocks that have changed since the last mesh extraction: a flag per slot, and a list of slots.
struct ChangedBlocks {
  uint32_t* flags;
  int32_t* slots;
  uint32_t* count;
};

/// Everything that kernels need to know about the map, passed by value.
struct MapView {
  PackedKey* hash_keys;
  int32_t* hash_slots;  ///< -1 if the key's block was released.
  uint32_t hash_mask;
  uint32_t slot_count;
  SlotEntry* slots;
  VoxelPool::View voxels;
  LabelPool::View unit_labels;
  ColourPool::View colours;
  /// For each brick of each voxel array: 1 plus its index in `colours`, or 0 if it has no colours.
  /// Null while nothing is painted.
  int32_t* colour_of;
  ChangedBlocks dirty;    ///< Blocks with changed voxels.
  ChangedBlocks painted;  ///< Blocks with changed colours; null while nothing is painted.
  /// For each slot, the ID of the last extraction that selected it.
  uint32_t* mesh_stamp;
};

struct ChangedLists {
  DeviceBuffer<uint32_t> flags;
  DeviceBuffer<int32_t> slots;
  DeviceBuffer<uint32_t> count;

  void grow(size_t slot_count, const Stream& stream) {
    flags.growZeroed(slot_count, stream);
    slots.growZeroed(slot_count, stream);
    count.growZeroed(1, stream);
  }
  ChangedBlocks view() const { return {flags.data(), slots.data(), count.data()}; }
  size_t bytes() const { return flags.bytes() + slots.bytes(); }
};

class DeviceMap {
 public:
  explicit DeviceMap(const Stream& stream);

  /// Reserves memory for adding blocks and arrays (an admission), so that it cannot run out later.
  /// @throws BackendError if memory runs out; the map stays intact.
  void reserve(const BlockTable& table, size_t new_blocks, size_t new_arrays);

  /// Records how many blocks and arrays a frame requested.
  void noteDemand(const PoolSizes& asked);
  /// Reserves memory for frames like the recent ones, if plenty is free. May be called while
  /// kernels read the map.
  void reserveAhead(const BlockTable& table);

  /// Mirrors an admission: adds blocks that are new or have new arrays, and zeroes these arrays.
  /// @pre reserve() was called for this admission.
  void enterBlocks(const BlockTable& table, const std::vector<int32_t>& slots,
                   const std::vector<int32_t>& arrays);

  /// Reserves memory for `new_colours` more bricks of colours. @throws BackendError like reserve().
  void reserveColours(const BlockTable& table, size_t new_colours);

  /// Mirrors an admission: adds new, unpainted bricks. @pre reserveColours() and keepColours() were
  /// called.
  void enterColours(const std::vector<NewBrick>& bricks);

  /// Adds colours to all meshes from the next extraction on. @pre reserveColours() was called.
  void keepColours();

  /// Reserves memory for `count` changes per call to sendChanges(). Waits until the previous
  /// changes are applied.
  void reserveChanges(size_t count);

  /// Queues a change to a slot, such as its release.
  void note(const SlotUpdate& change) { noted_.push_back(change); }
  /// Sends the queued changes to the device; enterBlocks() calls this first.
  /// @pre No extraction is reading the map.
  void sendChanges();

  void markAllDirty() { markAll(dirty_.view()); }

  /// Reserves memory for MeshMarks of `slots` slots. Neither this nor the next three functions may
  /// be called while an extraction is running.
  void reserveMarks(size_t slots);
  /// All marked slots, with their marks. Waits for the result.
  std::vector<MarkedSlot> marked();
  /// Returns and removes the marks of slots. Waits for the result.
  std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots);
  /// Adds marks to the existing ones.
  void setMarks(const std::vector<MarkedSlot>& marked);

  MapView view() const;  ///< Has no colours before keepColours() is called.

  VoxelPool& voxels() { return voxels_; }
  ColourPool& colours() { return colours_; }
  LabelPool& labels() { return unit_labels_; }
  void addMemory(const BlockTable& table, MapperMemory& memory) const;

 private:
  void reserveSlots(size_t count);
  void markAll(const ChangedBlocks& changed);
  void growColours(const PoolSizes& sizes);
  void reserveHash(size_t new_blocks, size_t live_blocks);

  const Stream& stream_;
  /// Largest demand of a recent frame; decays over time.
  PoolSizes recent_demand_ = {0, 0};
  size_t slot_count_ = 0;  ///< Number of slots that hold a block, or once did.
  size_t hash_used_ = 0;   ///< Upper bound on used entries, including those of released blocks.
  DeviceBuffer<PackedKey> hash_keys_;
  DeviceBuffer<int32_t> hash_slots_;
  size_t hash_size_ = 0;  ///< A power of two.
  DeviceBuffer<SlotEntry> slots_;
  DeviceBuffer<uint32_t> mesh_stamp_;
  ChangedLists dirty_, painted_;
  VoxelPool voxels_;
  LabelPool unit_labels_;
  ColourPool colours_;
  DeviceBuffer<int32_t> colour_of_;
  bool has_colours_ = false;
  /// Recorded after work that reads updates_, new_arrays_ or pinned_bricks_. The host waits for
  /// this event before it overwrites these buffers.
  Event updates_sent_;
  PinnedBuffer<SlotUpdate> updates_;
  PinnedBuffer<int32_t> new_arrays_;
  /// Recorded after kernels that read changes_. An admission waits for this event only if there are
  /// changes to send or blocks to read back from disk.
  Event changes_sent_;
  PinnedBuffer<SlotUpdate> changes_;
  std::vector<SlotUpdate> noted_;  ///< Changes not yet sent.
  Event marks_moved_;              ///< Recorded after kernels that use the next two buffers.
  PinnedBuffer<int32_t> marked_slots_;
  PinnedBuffer<MeshMarks> marks_;
  PinnedBuffer<NewBrick> pinned_bricks_;
  DeviceBuffer<NewBrick> new_bricks_;
};

/// A kernel of this binary, for testing whether the device can run its code.
const void* anyKernel();

/// The slot update for a block in the table.
SlotUpdate makeSlotUpdate(const BlockEntry& entry, int32_t slot, bool dirty = false);

}  // namespace gpu
}  // namespace dtsdf
