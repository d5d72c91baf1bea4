/// The mesh of a block, and mesh updates, which consist of block meshes.
#pragma once

#include <cstdint>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// A mesh vertex, which lies on an edge of a mesh unit, i.e. of a cube between eight voxels. `edge`
/// identifies the vertex within the block: ((index of the edge's lower corner) * 3 + axis) * 2 +
/// facing. Corners are indexed over the 9 x 9 x 9 corners of the block's mesh units, x fastest. If
/// facing is 0, the edge's lower corner is behind the surface.
///
/// A refined mesh (mesh/refine) also has vertices at the midpoints of triangle sides. The `edge` of
/// a midpoint is 4374 + 4374 * a + b, where a < b are the `edge` values of the two ends of the
/// side.
struct BlockVertex {
  Vec3f position;  ///< In voxels, relative to the block's first voxel; coordinates in [-2, 10].
  uint32_t edge;   ///< Identifies the vertex within its block.
};

/// Colour of a vertex, taken from colour images.
struct VertexColour {
  uint8_t red;      ///< 0 to 255.
  uint8_t green;    ///< 0 to 255.
  uint8_t blue;     ///< 0 to 255.
  uint8_t painted;  ///< 255 if the vertex has a colour; otherwise all four are 0.
};

/// Triangles of the mesh units of one block, counter-clockwise as viewed from the front. Vertices
/// on the block's upper faces (largest x, y or z) are repeated, bit for bit, by the neighbour that
/// owns their edge.
///
/// The midpoints of a refined mesh follow the vertices on grid edges, in the order of their mesh
/// units. A midpoint on the face between two units is listed once per unit, with identical values.
struct BlockMesh {
  BlockKey key;                       ///< Key of the block.
  std::vector<BlockVertex> vertices;  ///< First the vertices on grid edges, sorted by `edge`,
                                      ///< without duplicates; some may not be used by any triangle.
  std::vector<uint16_t> triangles;    ///< Three indices into `vertices` each, in canonical order.
  std::vector<VertexColour> colours;  ///< One per vertex; empty until the map is first painted.
};

/// Meshes of the blocks that changed since the last extraction. A block that no longer contains any
/// triangles is listed with an empty mesh.
struct MeshUpdate {
  std::vector<BlockMesh> blocks;  ///< Sorted by packed key.
  double duration_ms = 0.0;       ///< Time the extraction took.
  bool is_part = false;           ///< Whether the next extraction returns more changes: with
                                  ///< map/page_folder, large updates are split into parts.
};

}  // namespace dtsdf
