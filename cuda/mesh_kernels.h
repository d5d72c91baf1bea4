/// The stages of meshing on the device: what they read and write, and their launches.
#pragma once

#include "device_map.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/mesh_rules.h"
#include "launch.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

/// Space that the meshes take, whether they could be written or not.
struct MeshSize {
  uint32_t vertices, triangles;
};

/// All that the host has to know of an extraction.
struct MeshTotals {
  uint32_t reached;    ///< Blocks whose units have a corner in a changed block.
  uint32_t adjoining;  ///< Further ones that depend on changed voxels, indices or colours.
  MeshSize size;
  uint32_t finished;  ///< Blocks of threads that have made their meshes.
};

/// Where the mesh of one block lies.
struct MeshRecord {
  PackedKey key;
  int32_t slot;
  uint32_t first_vertex, vertices;
  uint32_t first_triangle, triangles;
  uint32_t gaps;  ///< Triangles that stand in gaps, which are marked.
};

/// Triangle of three 16-bit indices into the block's vertices.
struct BlockTriangle {
  uint16_t vertex[3];
};

/// What kernels need of an extraction, by value.
struct MeshView {
  MeshTotals* totals;
  MeshTotals* host_totals;  ///< Where the host finds them, in its own memory.
  int32_t* slots;           ///< First the reached blocks, then the adjoining ones.
  MeshRecord* records;      ///< One per block of `slots`.
  BlockVertex* vertices;
  Vec3f* normals;  ///< One per vertex on an edge, at its place; null: no refinement.
  BlockTriangle* triangles;
  VertexColour* colours;  ///< One per vertex; null while nothing is painted.
  MeshSize capacity;
  uint32_t stamp;          ///< Number of this extraction.
  int32_t least_evidence;  ///< That a voxel needs to be known.
  int32_t directional, refined;
  MeshSettings rules;
};

// Each enqueues one stage; `thread_blocks` fill the device, since how much there is to do is known
// there only.

/// Selects the blocks whose units have a corner in a changed block.
void reachBlocks(const MapView& map, const MeshView& mesh, int thread_blocks, const Stream& stream);

/// Indices of the units of these blocks; selects those that their changes adjoin.
void indexBlocks(const MapView& map, const MeshView& mesh, int thread_blocks, const Stream& stream);

/// Selects the blocks whose vertices have a painted voxel at an end of their edge.
void selectPainted(const MapView& map, const MeshView& mesh, int thread_blocks,
                   const Stream& stream);

/// Meshes of all selected blocks. What there is no room for is counted, not written.
void makeMeshes(const MapView& map, const MeshView& mesh, int thread_blocks, const Stream& stream);

/// Colours of their vertices.
void colourVertices(const MapView& map, const MeshView& mesh, int thread_blocks,
                    const Stream& stream);

}  // namespace gpu
}  // namespace dtsdf
