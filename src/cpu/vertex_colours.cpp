#include "cpu/vertex_colours.h"

#include <algorithm>
#include <optional>

namespace dtsdf {
namespace {

PaintedCorners paintedCorners(const ColouredCorners& coloured) {
  constexpr int kLast = kCornerGridSide - 1;
  PaintedCorners corners = {coloured, {}};
  visitDirections(directionsIn(coloured, {0, 0, 0}, {kLast, kLast, kLast}), [&](int d) {
    for (int z = 0; z <= kLast; ++z) {
      for (int y = 0; y <= kLast; ++y) {
        corners.rows[d][z][y] = static_cast<uint16_t>(paintedInRow(coloured, d, {0, y, z}, kLast));
      }
    }
  });
  return corners;
}

/// The first `count` vertices, which are those of edges.
void colourEdges(const ColouredCorners& corners, const std::vector<BlockVertex>& vertices,
                 size_t count, bool directional, std::vector<VertexColour>& colours) {
  std::optional<PaintedCorners> painted;  // as most vertices have a colour of their own
  for (size_t i = 0; i < count; ++i) {
    const auto edge = static_cast<int>(vertices[i].edge);
    colours[i] = ownColour(corners, edge, directional);
    if (colours[i].painted != 0) continue;
    if (!painted) painted = paintedCorners(corners);
    colours[i] = colourBeside(*painted, edge, directional);
  }
}

/// All that follow, which are the middles of sides between edges.
void colourMiddles(const ColouredCorners& corners, const std::vector<BlockVertex>& vertices,
                   size_t edges, bool directional, std::vector<VertexColour>& colours) {
  uint16_t vertex_of[kGridEdges] = {};
  for (size_t i = 0; i < edges; ++i) vertex_of[vertices[i].edge] = static_cast<uint16_t>(i);
  const auto colourOn = [&](int edge) {
    const size_t i = vertex_of[edge];
    const bool is_known = vertices[i].edge == static_cast<uint32_t>(edge);
    return is_known ? colours[i] : edgeColour(corners, edge, directional);  // it stands in gaps
  };
  for (size_t i = edges; i < vertices.size(); ++i) {
    const uint32_t number = vertices[i].edge;
    colours[i] = meanColour(colourOn(middleFirst(number)), colourOn(middleSecond(number)));
  }
}

}  // namespace

ColouredCorners colouredCorners(const CpuMap& map, const BlockKey& key, int32_t least_evidence) {
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

std::vector<VertexColour> vertexColours(const ColouredCorners& corners,
                                        const std::vector<BlockVertex>& vertices,
                                        bool directional) {
  const auto isMiddleOf = [](const BlockVertex& vertex) { return isMiddle(vertex.edge); };
  const auto middles = std::find_if(vertices.begin(), vertices.end(), isMiddleOf);
  const auto edges = static_cast<size_t>(middles - vertices.begin());
  std::vector<VertexColour> colours(vertices.size());
  colourEdges(corners, vertices, edges, directional, colours);
  if (edges < vertices.size()) colourMiddles(corners, vertices, edges, directional, colours);
  return colours;
}

}  // namespace dtsdf
