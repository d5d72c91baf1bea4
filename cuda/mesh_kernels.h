/// The meshing stages on the device: their data, and functions that enqueue them.
#pragma once

#include "device_map.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/mesh_rules.h"
#include "launch.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

/// Total size of all meshes, including those that do not fit into the buffers.
struct MeshSize {
  uint32_t vertices, triangles;
};

/// Counters of a mesh extraction or of a rendered view, for the host.
struct MeshTotals {
  /// Blocks with units (cubes between eight voxels) that have corners in a changed block; for a
  /// view, the blocks in view.
  uint32_t reached;
  uint32_t adjoining;  ///< Other blocks whose meshes depend on a changed block.
  MeshSize size;
  uint32_t finished;  ///< Thread blocks that have finished meshing.
};

/// Location of a block's mesh in the buffers of an extraction.
struct MeshRecord {
  PackedKey key;
  int32_t slot;
  uint32_t first_vertex, vertices;
  uint32_t first_triangle, triangles;
  uint32_t gaps;  ///< Number of triangles that span gaps; see isMarkedGap().
};

/// Triangle of three 16-bit indices into the block's vertices.
struct BlockTriangle {
  uint16_t vertex[3];
};

/// What kernels need to know about an extraction, passed by value.
struct MeshView {
  MeshTotals* totals;
  MeshTotals* host_totals;  ///< A copy in host memory.
  int32_t* slots;           ///< The `reached` blocks, then the `adjoining` ones.
  MeshRecord* records;      ///< One per block of `slots`.
  BlockVertex* vertices;
  Vec3f* normals;  ///< One per vertex on an edge, with the same index; null without refinement.
  BlockTriangle* triangles;
  VertexColour* colours;  ///< One per vertex; null while nothing is painted.
  MeshSize capacity;
  uint32_t stamp;        ///< ID of this extraction.
  int32_t min_evidence;  ///< Voxels with less evidence count as unknown.
  int32_t directional, refined;
  MeshSettings rules;
};

// Each function enqueues one step. `thread_blocks` should be enough to fill the device, since the
// host does not know how much work there is.

/// Selects the blocks with units that have corners in a changed block.
void reachBlocks(const MapView& map, const MeshView& mesh, int thread_blocks, const Stream& stream);

/// Finds the marching cubes cases of the blocks selected by reachBlocks(), and selects all other
/// neighbours of changed blocks.
void indexBlocks(const MapView& map, const MeshView& mesh, int thread_blocks, const Stream& stream);

/// Selects the blocks with vertices on edges that end at painted voxels.
void selectPainted(const MapView& map, const MeshView& mesh, int thread_blocks,
                   const Stream& stream);

/// Extracts the meshes of all selected blocks. Meshes that do not fit into the buffers are counted
/// but not written.
void makeMeshes(const MapView& map, const MeshView& mesh, int thread_blocks, const Stream& stream);

/// Colours the vertices of the meshes that makeMeshes() extracted.
void colourVertices(const MapView& map, const MeshView& mesh, int thread_blocks,
                    const Stream& stream);

}  // namespace gpu
}  // namespace dtsdf
