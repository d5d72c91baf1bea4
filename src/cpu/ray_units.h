/// The units of the map as rays of one camera meet them, each made once for those of a thread.
#pragma once

#include <memory>
#include <vector>

#include "cpu/vertex_colours.h"
#include "kernels/core/camera.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/render/pixel.h"

namespace dtsdf {

/// The voxels of a block that are known in some direction: a bit each, by rows.
struct KnownVoxels {
  uint8_t row[kBlockSide * kBlockSide];
};

constexpr int32_t kNotInView = -1;

/// A view's camera, and what its units are made of.
struct RayScene {
  MeshedMap map;
  FrameView frame;
  MeshRules rules;
  int32_t least_evidence;
  bool directional;
  bool painted;  ///< Colours are asked for.
  const std::vector<KnownVoxels>& known;       ///< Of the blocks in view,
  const std::vector<int32_t>& number_of_slot;  ///< whose places are here, or kNotInView.
};

/// For one thread, while the map does not change. Units and blocks that lie apart may share a place
/// in the caches: the newest one has it.
class RayUnits {
 public:
  explicit RayUnits(const RayScene& scene);

  /// As castRay() asks.
  bool hasBlock(const Vec3i& block_L) { return blockAt(block_L + origin_block_).entry != nullptr; }
  const RayUnit& find(const Vec3i& unit) {
    if (!isFirstCornerKnown(unit + scene_.frame.origin_voxel)) return unknown_;
    KnownUnit& known = units_[placeOf(unit)];
    if (known.at != unit) {
      known.at = unit;
      known.unit = make(unit);
    }
    return known.unit;
  }

  /// Of a unit that find() gave.
  const UnitColours& coloursAt(const Vec3i& unit);

 private:
  static constexpr uint32_t kUnits = 8192, kBlocks = 256;
  static constexpr int32_t kNowhere = INT32_MIN;

  struct KnownUnit {
    Vec3i at{kNowhere, 0, 0};
    RayUnit unit;
  };
  struct KnownColours {
    Vec3i at{kNowhere, 0, 0};
    UnitColours colours;
  };
  struct KnownBlock {
    BlockKey key{kNowhere, 0, 0};
    const BlockEntry* entry = nullptr;
    const KnownVoxels* voxels = nullptr;  ///< Null for blocks that are not in view.
  };
  /// Where the voxel of a unit's corner is.
  struct Corner {
    const BlockEntry* entry;
    int voxel;
  };

  /// Mixes the coordinates; what lies side by side never shares a place.
  static uint32_t placeOf(const Vec3i& at) {
    return (static_cast<uint32_t>(at.x) * 73u + static_cast<uint32_t>(at.y) * 1087u +
            static_cast<uint32_t>(at.z) * 3571u) %
           kUnits;
  }
  const KnownBlock& blockAt(const BlockKey& key) {
    KnownBlock& known = blocks_[placeOf(key) % kBlocks];
    if (known.key != key) lookUp(key, known);
    return known;
  }
  /// In any direction. Of most units that a ray meets it is not, and so the unit is not.
  bool isFirstCornerKnown(const Vec3i& at) {
    const KnownVoxels* voxels = blockAt(blockOfVoxel(at)).voxels;
    constexpr int kMask = kBlockSide - 1;
    return voxels == nullptr ||
           (voxels->row[(at.y & kMask) + kBlockSide * (at.z & kMask)] >> (at.x & kMask) & 1) != 0;
  }
  void lookUp(const BlockKey& key, KnownBlock& known) const;
  Corner cornerAt(const Vec3i& unit, int c);
  RayUnit make(const Vec3i& unit);
  ColouredSample colouredAt(const Corner& corner, int direction) const;

  const RayScene& scene_;
  const RayUnit unknown_ = unitWithoutSurface(UnitState::kUnknown);
  const BlockKey origin_block_;
  std::unique_ptr<KnownUnit[]> units_;
  std::unique_ptr<KnownColours[]> colours_;
  std::unique_ptr<KnownBlock[]> blocks_;
};

}  // namespace dtsdf
