/// The map on the device: a mirror of the host's BlockTable, and the memory of voxels and mesh
/// indices.
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

/// A key that no block can have: marks empty places of the hash tables.
constexpr PackedKey kNoKey = ~PackedKey{0};

/// 512 voxel arrays of 4 KiB, 4096 bricks of colours of 256 bytes, and 1024 sets of unit labels of
/// 1 KiB, a slab.
using VoxelPool = SlabPool<Voxel, kVoxelsPerBlock, 9>;
using ColourPool = SlabPool<VoxelColour, kVoxelsPerBrick, 12>;
using LabelPool = SlabPool<UnitLabels, kVoxelsPerBlock, 10>;

/// What the device knows of a block; key is kNoKey while the slot is free.
struct SlotEntry {
  PackedKey key;
  int32_t array[kDirectionCount];
};

/// A slot's new contents, or its release.
struct SlotUpdate {
  SlotEntry entry;
  int32_t slot;
  int32_t in_use;
  int32_t dirty;  ///< The block is to be meshed again.
};

/// Blocks that changed in some way since the last extraction: a flag per slot, and their list.
struct ChangedBlocks {
  uint32_t* flags;
  int32_t* slots;
  uint32_t* count;
};

/// Everything that kernels need of the map, by value.
struct MapView {
  PackedKey* hash_keys;
  int32_t* hash_slots;  ///< -1 where the key's block was released.
  uint32_t hash_mask;
  uint32_t slot_count;
  SlotEntry* slots;
  VoxelPool::View voxels;
  LabelPool::View unit_labels;
  ColourPool::View colours;
  /// Numbers of its bricks of colours plus 1, per voxel array; 0: none. Null while nothing is
  /// painted.
  int32_t* colour_of;
  ChangedBlocks dirty;    ///< Those whose voxels changed.
  ChangedBlocks painted;  ///< Those whose colours changed; null while nothing is painted.
  /// Number of the last extraction that selected a slot.
  uint32_t* mesh_stamp;
};

/// The memory of these lists.
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

  /// Makes room for an admission; nothing that follows it can then fail for want of memory.
  /// @throws BackendError without device memory; what is mapped stays intact.
  void reserve(const BlockTable& table, size_t new_blocks, size_t new_arrays);

  /// What a frame asks for: reserveAhead() makes room for another one like those of late, where
  /// memory is plenty. It is called while the device has other work, which may read the map.
  void noteDemand(const PoolSizes& asked);
  void reserveAhead(const BlockTable& table);

  /// Follows an admission: these blocks are new, or have new arrays; those are to be zeroed.
  /// @pre reserve() made the room.
  void enterBlocks(const BlockTable& table, const std::vector<int32_t>& slots,
                   const std::vector<int32_t>& arrays);

  /// Makes room for so many more bricks of colours. @throws BackendError as reserve() does.
  void reserveColours(const BlockTable& table, size_t new_colours);

  /// Follows an admission: new bricks are there, nothing in them painted.
  /// @pre reserveColours() made the room, and colours are kept.
  void enterColours(const std::vector<NewBrick>& bricks);

  /// From now on, all meshes have colours: every mesh gets them. @pre reserveColours() was called.
  void keepColours();

  /// Makes room for so many changes at a time, and waits until the last ones are on the device.
  void reserveChanges(size_t count);

  /// Notes the release of arrays or whole blocks. Nothing is told of it to the device before
  /// sendChanges(), which the next admission calls: no extraction may read the map then.
  void note(const SlotUpdate& change) { noted_.push_back(change); }
  void sendChanges();

  /// Has every block meshed again.
  void markAllDirty() { markAll(dirty_.view()); }

  /// Makes room for so many slots in takeMarks() and setMarks(). None of these is called while an
  /// extraction is under way.
  void reserveMarks(size_t slots);
  /// All that is marked for the next extraction; waits for it.
  std::vector<MarkedSlot> marked();
  /// Takes the marks of slots; waits for them.
  std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots);
  /// Sets them; others stay.
  void setMarks(const std::vector<MarkedSlot>& marked);

  MapView view() const;  ///< Without colours until there are some.

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
  PoolSizes lately_ = {0, 0};  ///< The most that a frame has asked for, which fades.
  size_t slot_count_ = 0;      ///< Slots that hold, or held, a block.
  size_t hash_used_ = 0;  ///< Upper bound of the table's places in use, released ones included.
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
  /// Recorded after admissions, which kernels read in place: after it the host may write new ones.
  Event updates_sent_;
  PinnedBuffer<SlotUpdate> updates_;
  PinnedBuffer<int32_t> new_arrays_;
  /// Recorded after other changes of the table, which no admission has to wait for.
  Event changes_sent_;
  PinnedBuffer<SlotUpdate> changes_;
  std::vector<SlotUpdate> noted_;  ///< Changes that are still to be sent.
  Event
      marks_moved_;  ///< With the lists that kernels read, and the marks that they read and write.
  PinnedBuffer<int32_t> marked_slots_;
  PinnedBuffer<MeshMarks> marks_;
  PinnedBuffer<NewBrick> pinned_bricks_;
  DeviceBuffer<NewBrick> new_bricks_;
};

/// Some kernel of this binary, to find out whether the device can run its code.
const void* anyKernel();

/// The slot update that mirrors a block of the table.
SlotUpdate makeSlotUpdate(const BlockEntry& entry, int32_t slot, bool dirty = false);

}  // namespace gpu
}  // namespace dtsdf
