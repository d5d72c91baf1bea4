#include "cpu/ray_blocks.h"

namespace dtsdf {
namespace {

/// What is read where there is nothing.
const Voxel kNoVoxels[kVoxelsPerBlock] = {};

}  // namespace

void RayBlocks::begin(const RayScene& scene, size_t blocks_in_view) {
  scene_ = &scene;
  made_.begin();
  coloured_.begin();
  if (blocks_in_view > room_) {
    blocks_ = std::make_unique<RayBlock[]>(blocks_in_view);
    room_ = blocks_in_view;
  }
  for (size_t i = 0; i < blocks_in_view; ++i) {
    blocks_[i].is_ready.store(false, std::memory_order_relaxed);
  }
}

/// A block whose arrays have gone may stay in the table of one backend longer than of the other.
int32_t RayBlocks::slotOf(const BlockKey& key) const {
  const int32_t slot = isRepresentable(key) ? scene_->map.table.find(packKey(key)) : -1;
  return slot >= 0 && directionsWithArrays(scene_->map.table.block(slot)) != 0 ? slot : -1;
}

RayBlock* RayBlocks::find(const BlockKey& key) {
  const int32_t slot = slotOf(key);
  const int32_t number = slot < 0 ? kNotInView : scene_->number_of_slot[static_cast<size_t>(slot)];
  if (number == kNotInView) return nullptr;
  RayBlock& block = blocks_[static_cast<size_t>(number)];
  if (!block.is_ready.load(std::memory_order_acquire)) {
    const std::lock_guard<std::mutex> lock(locks_[static_cast<size_t>(number) % kLocks]);
    if (!block.is_ready.load(std::memory_order_relaxed)) fill(key, slot, block);
  }
  return &block;
}

void RayBlocks::fillCorner(int32_t slot, int c, RayBlock& block) const {
  block.entry[c] = slot < 0 ? nullptr : &scene_->map.table.block(slot);
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t array = slot < 0 ? kNoArray : block.entry[c]->array[d];
    block.voxels[c][d] = array == kNoArray ? kNoVoxels : scene_->map.voxels.array(array);
  }
}

void RayBlocks::fill(const BlockKey& key, int32_t slot, RayBlock& block) const {
  VoxelBits out_of_view[kCubeCorners];
  const VoxelBits* bits[kCubeCorners] = {};
  for (int c = 0; c < kCubeCorners; ++c) {
    if (c > 0) slot = slotOf(key + Vec3i{c & 1, c >> 1 & 1, c >> 2});
    fillCorner(slot, c, block);
    if (slot < 0) continue;
    const int32_t number = scene_->number_of_slot[static_cast<size_t>(slot)];
    if (number != kNotInView) {
      bits[c] = &scene_->bits[static_cast<size_t>(number)];
      continue;
    }
    out_of_view[c] = voxelBitsOf(*block.entry[c], scene_->map.voxels, scene_->least_evidence);
    bits[c] = &out_of_view[c];
  }
  block.units = unitBitsOf(bits);
  block.made.store(nullptr, std::memory_order_relaxed);
  block.coloured.store(nullptr, std::memory_order_relaxed);
  block.is_ready.store(true, std::memory_order_release);
}

size_t RayBlocks::bytes() const {
  return room_ * sizeof(RayBlock) + made_.bytes() + coloured_.bytes();
}

}  // namespace dtsdf
