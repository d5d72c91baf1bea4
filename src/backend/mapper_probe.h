/// A mapper from inside, for benchmarks and tests: what it holds, and where its time goes.
#pragma once

#include <vector>

#include "backend/profile.h"
#include "dtsdf_mapping/map_parts.h"
#include "dtsdf_mapping/mapper.h"
#include "map/block_extent.h"

namespace dtsdf {

/// A mapper with a view inside, and what a box of a larger map needs beside it.
class ProbedMapper : public Mapper {
 public:
  /// Waits until the meshes of the extraction that was begun are made, where the map lives; on a
  /// GPU they are on their way to the host then. finishMeshUpdate() waits by itself.
  virtual void waitForMeshes() = 0;

  /// Adds the time of each stage to a profile from now on, until another or nullptr is given. On a
  /// GPU the times of a frame are there once the next mesh update is finished, and measuring keeps
  /// host and device from overlapping: what a frame takes in all is to be measured without.
  virtual void profileTo(Profile* profile) = 0;

  /// What holds how much memory now; the parts of a GPU's map are on the GPU, but for staging. It
  /// costs no more in a large map than in a small one.
  virtual std::vector<MemoryPart> memoryParts() const = 0;

  /// The sums of memoryParts().
  MapperMemory memory() const override;

  /// Takes contents in whose head was checked. @pre The map is empty.
  /// @throws std::exception without memory; the mapper is of no use then.
  virtual void restore(const MapParts& parts) = 0;

  /// From now on the map is a box: only what lies in this extent is made, and the rest is not
  /// counted as refused. Its blocks and cells are those of the whole map, to the last bit, as no
  /// depth frame changes one by what others hold. Colours are where all blocks are made that may
  /// hide the painted ones from an image, and colour/exposure is fixed: else an image's exposure is
  /// found from all of the map. To be called before the first frame.
  virtual void restrictTo(const MapExtent& extent) = 0;

  /// Depth frames so far that touched a block, also outside of the extent.
  virtual uint64_t supportingFrames() const = 0;
};

}  // namespace dtsdf
