/// A chunk of the mesh with less detail, to be looked at from far away.
#pragma once

#include "meshing/packed_chunk.h"

namespace dtsdf {

/// The chunk with one vertex for all that lie in one cell and face the same of six ways: both sides
/// of a thin thing stay apart. Cells are cubes of 2^cell_log2 steps, the same for all chunks, and a
/// vertex goes to the middle of its cell, a quarter towards where it faces: chunks side by side
/// still meet. Triangles that are left without area are left out.
PackedChunk coarsen(const PackedChunk& chunk, int cell_log2);

}  // namespace dtsdf
