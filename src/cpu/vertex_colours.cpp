#include "cpu/vertex_colours.h"

namespace dtsdf {
namespace {

ColouredCorners cornersOf(const MeshedMap& map, const BlockKey& key, int32_t least_evidence) {
  ColouredCorners corners = {};
  corners.voxels.least_evidence = least_evidence;
  for (int n = 0; n < kCornerBlocks; ++n) {
    const int32_t slot = map.table.find(packKey(key + cornerBlockOffset(n)));
    if (slot < 0) continue;
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = map.table.block(slot).array[d];
      if (array == kNoArray) continue;
      corners.voxels.array[n][d] = map.voxels.array(array);
      for (int brick = 0; brick < kBricksPerArray; ++brick) {
        const int32_t number = map.table.colourOf(array, brick);
        if (number != kNoArray) corners.setBrick(n, d, brick, map.colours.array(number));
      }
    }
  }
  return corners;
}

}  // namespace

std::vector<VertexColour> vertexColours(const MeshedMap& map, const BlockMesh& mesh,
                                        int32_t least_evidence, bool directional) {
  const ColouredCorners corners = cornersOf(map, mesh.key, least_evidence);
  std::vector<VertexColour> colours;
  colours.reserve(mesh.vertices.size());
  for (const BlockVertex& vertex : mesh.vertices) {
    colours.push_back(vertexColourOf(corners, vertex.edge, directional));
  }
  return colours;
}

}  // namespace dtsdf
