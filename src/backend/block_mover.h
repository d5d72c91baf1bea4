/// What paging asks of a backend: which blocks an image needs, and what belongs to a block beside
/// its voxels and colours.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "map/record_bytes.h"

namespace dtsdf {

struct MapSize;

/// What the next extraction is to do with a block.
struct MeshMarks {
  bool dirty = false;    ///< Its voxels changed.
  bool painted = false;  ///< Its colours changed.
};

/// What meshing knows of a block, beside labels of its units.
struct MeshState {
  MeshMarks marks;
  bool has_mesh = false;    ///< The last one that was handed out has triangles.
  bool has_labels = false;  ///< Labels are in its record; else none of them says anything.
};

/// Blocks that leave. A record has the voxels of a block, direction by direction, its bricks of
/// colours and, where it has some, the labels of its units: records lie back to back.
struct LeavingBlocks {
  std::vector<MeshState> states;
  SharedRecords records;
};

/// A block that is back.
struct ArrivingBlock {
  MeshState state;
  RecordPlace record;  ///< Nowhere: it has no voxels, and no labels.
};

class BlockMover {
 public:
  virtual ~BlockMover() = default;

  /// Blocks that the last depth image touches, in the map or not. @pre MapBackend::touched()
  virtual std::vector<PackedKey> touchedKeys() = 0;

  /// Those blocks of a list, in the map or not, that the last depth image may clear though it does
  /// not touch them. @pre MapBackend::touched()
  virtual std::vector<PackedKey> seenThrough(const std::vector<PackedKey>& keys,
                                             uint64_t frame_number) = 0;

  /// Blocks that MapBackend::sumsAt() looks at, each once.
  virtual std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) = 0;

  /// Slots that are marked for the next extraction. @pre None is under way.
  virtual std::vector<int32_t> markedSlots() = 0;

  /// Takes the memory that moving so much needs: nothing that follows lacks it then.
  /// @throws BackendError without it.
  virtual void reserve(const MapSize& size) { static_cast<void>(size); }

  /// Makes memory from which records come back in the shortest way.
  virtual RecordsMaker recordsMaker() { return makePlainRecords; }

  /// Takes all that is kept of blocks, which are marked no longer and may be released when this
  /// returns; their records may come later. @throws BackendError without memory; nothing has
  /// changed then.
  virtual LeavingBlocks takeOut(const std::vector<int32_t>& slots) = 0;

  /// Gives it back, of blocks that are back, at other slots maybe. The caller may let go of the
  /// records at once.
  virtual void putIn(const std::vector<int32_t>& slots,
                     const std::vector<ArrivingBlock>& blocks) = 0;

  /// Takes the marks of these slots, and sets them.
  virtual std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots) = 0;
  virtual void setMarks(const std::vector<int32_t>& slots, const std::vector<MeshMarks>& marks) = 0;
};

}  // namespace dtsdf
