/// Access to a mapper's internals, for benchmarks, tests and maps that are divided into tiles.
#pragma once

#include "backend/profile.h"
#include "dtsdf_mapping/map_parts.h"
#include "dtsdf_mapping/mapper.h"
#include "map/block_extent.h"

namespace dtsdf {

/// A mapper with access to its internals. It can also be a tile of a larger map.
class ProbedMapper : public Mapper {
 public:
  /// Waits until the extraction in progress has computed its meshes. On a GPU, they may not yet be
  /// copied to the host. finishMeshUpdate() does not require this call.
  virtual void waitForMeshes() = 0;

  /// Adds the host time of each stage to a profile until called with another profile or nullptr. To
  /// profile kernels on a GPU, use NVIDIA's tools.
  virtual void profileTo(Profile* profile) = 0;

  /// Loads a map. @pre checkHead(*parts.head) has passed, and this map is empty.
  /// @throws std::exception if memory runs out, blocks cannot be paged to disk, or the parts cannot
  /// be read; the mapper is then unusable.
  virtual void restore(const MapParts& parts) = 0;

  /// Restricts the map to an extent. Blocks outside are ignored, and do not count as refused.
  /// Blocks and cells inside equal those of the whole map bit for bit, since blocks are fused
  /// independently of each other. For equal colours, colour/exposure must be fixed (adaptive
  /// exposure depends on the whole map), and the extent must include all blocks that may hide
  /// painted ones. Call this before the first frame.
  virtual void restrictTo(const MapExtent& extent) = 0;

  /// Number of depth frames so far that touched a block, inside or outside the extent.
  virtual uint64_t supportingFrames() const = 0;
};

}  // namespace dtsdf
