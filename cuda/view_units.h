/// The units that rays of a view may meet a surface in, made before the rays are cast: a thread for
/// each, where rays would wait for each other.
#pragma once

#include <vector>

#include "backend/profile.h"
#include "device_map.h"
#include "kernels/core/camera.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/render/block_bits.h"
#include "kernels/render/ray_unit.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// What kernels need of a view's map, by value.
struct ViewScene {
  FrameView frame;
  const MeshTables* tables;
  MeshRules rules;
  int32_t least_evidence;
  int32_t directional;
};

/// The bits of a block's voxels.
struct VoxelBits {
  BlockBits known, behind;
};

/// The bits of a block's units, and where those are that were made.
struct UnitPlaces {
  BlockBits known;              ///< Of all corners something is known.
  BlockBits made;               ///< And some is behind a surface; the other ones lie in front.
  uint32_t first;               ///< The place of the block's first unit.
  uint16_t before[kBlockSide];  ///< Units in the layers below.
};

/// For kernels, by value. Bits and places by slot.
struct ViewUnits {
  VoxelBits* bits;
  UnitPlaces* places;
  RayUnit* units;
  uint32_t* count;
};

/// The buffers are kept from view to view.
class UnitMaker {
 public:
  explicit UnitMaker(const Stream& stream) : stream_(stream) {}

  /// Makes room for bits and places; the count is 0. A kernel is to write the bits of all blocks
  /// with voxels within mayHaveUnits().
  ViewUnits begin(const MapView& map);

  /// Makes the units from the bits; waits once, for their number.
  ViewUnits make(const ViewScene& scene, const MapView& map);

  size_t bytes() const;

 private:
  ViewUnits view() const;

  const Stream& stream_;
  DeviceBuffer<VoxelBits> bits_;
  DeviceBuffer<UnitPlaces> places_;
  DeviceBuffer<RayUnit> units_;
  DeviceBuffer<uint32_t> count_;
  PinnedBuffer<uint32_t> pinned_count_;
};

}  // namespace gpu
}  // namespace dtsdf
