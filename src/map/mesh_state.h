/// What belongs to a block beside its voxels and colours: what meshing knows of it.
#pragma once

#include <cstdint>

#include "kernels/core/grid.h"

namespace dtsdf {

/// What the next extraction is to do with a block.
struct MeshMarks {
  bool dirty = false;    ///< Its voxels changed.
  bool painted = false;  ///< Its colours changed.

  DTSDF_HD bool any() const { return dirty || painted; }
};

/// A block of the map that is to be meshed again.
struct MarkedSlot {
  int32_t slot;
  MeshMarks marks;
};

/// What meshing knows of a block, beside labels of its units.
struct MeshState {
  MeshMarks marks;
  bool has_mesh = false;    ///< The last one that was handed out has triangles.
  bool has_labels = false;  ///< Its units have labels; else none of them says anything.
};

}  // namespace dtsdf
