/// The mesh of one block, and updates of a mesh by blocks.
#pragma once

#include <cstdint>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// A vertex belongs to an edge of the grid. `edge` identifies it inside the block: ((index of the
/// edge's lower corner) * 3 + axis) * 2 + facing. The corners are those of the block's mesh units,
/// 9 x 9 x 9, x fastest. With facing 0, the lower end is behind the surface.
///
/// A refined mesh (mesh/refine) also has vertices at the midpoints of triangle sides. A midpoint's
/// `edge` is 4374 + 4374 * a + b, where a < b are the `edge` values of the side's ends.
struct BlockVertex {
  Vec3f position;  ///< In voxels, relative to the block's first voxel; coordinates in [-2, 10].
  uint32_t edge;   ///< Identifies the vertex in its block.
};

/// Colour of a vertex, taken from colour images.
struct VertexColour {
  uint8_t red;      ///< 0 to 255.
  uint8_t green;    ///< 0 to 255.
  uint8_t blue;     ///< 0 to 255.
  uint8_t painted;  ///< 255; if the vertex has no colour, all four are 0.
};

/// Triangles of the mesh units of one block, counter-clockwise seen from the front. Vertices on the
/// block's far faces are repeated, bit for bit, by the neighbour that owns their edge.
///
/// The midpoints of a refined mesh follow the vertices on edges, in the order of their units. A
/// midpoint on the face between two units is listed for each of them, with the same `edge` and the
/// same bits.
struct BlockMesh {
  BlockKey key;                       ///< Key of the block.
  std::vector<BlockVertex> vertices;  ///< First those on edges, sorted by `edge`, without
                                      ///< duplicates; some may belong to no triangle.
  std::vector<uint16_t> triangles;    ///< Three indices into `vertices` each, in canonical order.
  std::vector<VertexColour> colours;  ///< One per vertex; empty before the map is first painted.
};

/// Meshes of blocks that changed since the last extraction. If the mesh of a block vanished, the
/// block is listed without triangles.
struct MeshUpdate {
  std::vector<BlockMesh> blocks;  ///< Sorted by packed key.
  double duration_ms = 0.0;       ///< Time the extraction took.
  bool is_part = false;           ///< Whether the next extraction returns more changes: with
                                  ///< map/page_folder, large updates come in parts.
};

}  // namespace dtsdf
