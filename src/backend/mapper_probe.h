/// Access to a mapper's internals, for benchmarks, tests and tiles of larger maps.
#pragma once

#include "backend/profile.h"
#include "dtsdf_mapping/map_parts.h"
#include "dtsdf_mapping/mapper.h"
#include "map/block_extent.h"

namespace dtsdf {

/// A mapper with access to its internals. It can also be a tile of a larger map.
class ProbedMapper : public Mapper {
 public:
  /// Waits until the extraction under way has computed its meshes. On a GPU, the copy to the host
  /// may still be under way. Not needed before finishMeshUpdate().
  virtual void waitForMeshes() = 0;

  /// Adds the host time of each stage to a profile until another profile or nullptr is given. For a
  /// GPU's kernels, use NVIDIA's profilers.
  virtual void profileTo(Profile* profile) = 0;

  /// Fills the map with contents. @pre The head was checked, and the map is empty.
  /// @throws std::exception if memory runs out, blocks cannot be paged to disk, or the parts cannot
  /// be read; the mapper is then unusable.
  virtual void restore(const MapParts& parts) = 0;

  /// Restricts the map to an extent. Blocks outside are ignored, and do not count as refused.
  /// Blocks and cells inside equal those of the whole map, bit for bit, since fusion never lets one
  /// block affect another. For equal colours, colour/exposure must be fixed (adaptive exposure
  /// depends on the whole map), and the extent must include all blocks that may hide painted ones.
  /// Call this before the first frame.
  virtual void restrictTo(const MapExtent& extent) = 0;

  /// Number of depth frames so far that touched a block, inside or outside the extent.
  virtual uint64_t supportingFrames() const = 0;
};

}  // namespace dtsdf
