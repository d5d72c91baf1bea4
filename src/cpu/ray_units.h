/// The units of the map as the rays of a thread ask for them.
#pragma once

#include "cpu/ray_blocks.h"

namespace dtsdf {

class RayUnits {
 public:
  explicit RayUnits(RayBlocks& blocks)
      : blocks_(blocks), origin_block_(blockOfVoxel(blocks.scene().frame.origin_voxel)) {}

  /// As castRay() asks.
  bool enter(const Vec3i& block_L) {
    const BlockKey key = block_L + origin_block_;
    KnownBlock& known = known_[placeOf(key)];
    if (known.key != key) known = {key, blocks_.find(key)};
    block_ = known.block;
    return block_ != nullptr;
  }
  const RayUnit& find(const Vec3i& unit) {
    if (!has(block_->units.known, unit)) return unknown_;
    if (!has(block_->units.behind, unit)) return front_;
    return made(unit);
  }

  /// Of a unit of the block that was entered last.
  const UnitColours& coloursAt(const Vec3i& unit);

 private:
  static constexpr uint32_t kBlocks = 256;
  static constexpr int32_t kNowhere = INT32_MIN;

  /// Blocks that lie apart may share a place: the newest one has it.
  struct KnownBlock {
    BlockKey key{kNowhere, 0, 0};
    RayBlock* block = nullptr;  ///< Null: the map has none.
  };

  /// Mixes the coordinates; what lies side by side never shares a place.
  static uint32_t placeOf(const BlockKey& key) {
    return (static_cast<uint32_t>(key.x) * 73u + static_cast<uint32_t>(key.y) * 1087u +
            static_cast<uint32_t>(key.z) * 3571u) %
           kBlocks;
  }
  const RayUnit& made(const Vec3i& unit);

  RayBlocks& blocks_;
  const BlockKey origin_block_;
  const RayUnit unknown_ = unitWithoutSurface(UnitState::kUnknown);
  const RayUnit front_ = unitWithoutSurface(UnitState::kFront);
  RayBlock* block_ = nullptr;  ///< That was entered last.
  RayUnit own_unit_;           ///< While another thread makes it too.
  UnitColours own_colours_;
  KnownBlock known_[kBlocks];
};

}  // namespace dtsdf
