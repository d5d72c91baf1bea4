#include "cpu/vertex_colours.h"

namespace dtsdf {
ColouredCorners colouredCorners(const CpuMap& map, const BlockKey& key, int32_t min_evidence) {
  ColouredCorners corners = {};
  corners.voxels.min_evidence = min_evidence;
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

std::vector<VertexColour> vertexColours(ColouredCorners corners,
                                        const std::vector<BlockVertex>& vertices,
                                        bool directional) {
  bool knows_painted = false;  // painted rows are found when first needed
  const auto colourOn = [&](int edge) {
    const VertexColour own = colourOnEdge(corners, edge, directional);
    if (own.painted != 0) return own;
    for (int i = 0; i < kPaintedRows && !knows_painted; ++i) findPaintedRow(corners, i);
    knows_painted = true;
    return colourNearEdge(corners, edge, directional);
  };
  std::vector<VertexColour> colours(vertices.size());
  uint16_t vertex_of[kGridEdges] = {};  // edge vertices come before midpoints
  const auto colourOfEnd = [&](int edge) {
    const size_t i = vertex_of[edge];
    const bool is_known = vertices[i].edge == static_cast<uint32_t>(edge);
    return is_known ? colours[i] : colourOn(edge);  // an end is missing only at gaps
  };
  for (size_t i = 0; i < vertices.size(); ++i) {
    const uint32_t number = vertices[i].edge;
    if (isMidpoint(number)) {
      colours[i] =
          meanColour(colourOfEnd(midpointFirstEnd(number)), colourOfEnd(midpointSecondEnd(number)));
    } else {
      colours[i] = colourOn(static_cast<int>(number));
      vertex_of[number] = static_cast<uint16_t>(i);
    }
  }
  return colours;
}

}  // namespace dtsdf
