/// The meshing state of each block.
#pragma once

#include <cstdint>

#include "kernels/core/grid.h"

namespace dtsdf {

/// What changed in a block since the last extraction.
struct MeshMarks {
  bool dirty = false;    ///< Its voxels changed.
  bool painted = false;  ///< Its colours changed.

  DTSDF_HD bool any() const { return dirty || painted; }
};

/// A block to be remeshed.
struct MarkedSlot {
  int32_t slot;
  MeshMarks marks;
};

/// Meshing state of a block. The labels of its mesh units (see UnitLabels) are stored separately.
struct MeshState {
  MeshMarks marks;
  bool has_mesh = false;    ///< Whether its last delivered mesh has triangles.
  bool has_labels = false;  ///< Whether the labels of its units are stored.
};

}  // namespace dtsdf
