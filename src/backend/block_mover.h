/// What paging asks of a backend: which blocks an image needs, and what belongs to a block beside
/// its voxels and colours.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// What the next extraction is to do with a block.
struct MeshMarks {
  bool dirty = false;    ///< Its voxels changed.
  bool painted = false;  ///< Its colours changed.
};

/// What meshing knows of a block.
struct MeshState {
  MeshMarks marks;
  bool has_mesh = false;           ///< The last one that was handed out has triangles.
  std::vector<UnitLabels> labels;  ///< One per unit; empty: none says anything.
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

  /// Takes the memory that moving so many blocks needs: nothing that follows lacks it then.
  /// @throws BackendError without it.
  virtual void reserve(size_t slots) { static_cast<void>(slots); }

  /// Takes what meshing knows of blocks that leave: they are marked no longer.
  virtual std::vector<MeshState> takeMeshStates(const std::vector<int32_t>& slots) = 0;

  /// Gives it back, of blocks that are back, at other slots maybe.
  virtual void enterMeshStates(const std::vector<int32_t>& slots,
                               const std::vector<MeshState>& states) = 0;

  /// Takes the marks of these slots, and sets them.
  virtual std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots) = 0;
  virtual void setMarks(const std::vector<int32_t>& slots, const std::vector<MeshMarks>& marks) = 0;
};

}  // namespace dtsdf
