#include "cpu/vertex_colours.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include "cpu/lanes.h"
#include "cpu/voxel_row.h"
#include "cpu/widest_vectors.h"

namespace dtsdf {
namespace {

/// As many colours as there are lanes.
struct LaneVoxelColours {
  LaneInts word;
};

LaneInts byteOf(const LaneVoxelColours& colours, int number) {
  constexpr bool kLittle = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
  return LaneInts(colours.word.v >> (kLittle ? 8 * number : 24 - 8 * number) & 255);
}

/// For meanOnEdge().
LaneInts isPainted(const LaneVoxelColours& colours) { return byteOf(colours, 3) != LaneInts(0); }
RgbOf<LaneFloats> rgbOf(const LaneVoxelColours& colours) {
  return {toFloats(byteOf(colours, 0)), toFloats(byteOf(colours, 1)), toFloats(byteOf(colours, 2))};
}

const VoxelColour kNoColours[kVoxelsPerBrick] = {};
const Voxel kNoVoxels[kVoxelsPerBlock] = {};

/// Some edges, side by side, for meanOnEdge().
class EdgeLanes {
 public:
  EdgeLanes(const ColouredCorners& corners, const BlockVertex* vertices, int count,
            bool directional)
      : least_evidence_(corners.voxels.least_evidence) {
    for (int k = 0; k < kLanes; ++k) {
      const auto edge = static_cast<int>(vertices[std::min(k, count - 1)].edge);
      const AskedEdge asked = askedEdge(corners, edge, directional);
      lower_[k] = endAt(corners, asked.lower);
      upper_[k] = endAt(corners, asked.upper);
      asked_.v[k] = static_cast<int32_t>(asked.directions);
      facing_.v[k] = edgeFacing(edge);
    }
  }

  ColourMeanOf<LaneFloats> mean() const { return meanOnEdge<LaneFloats>(asked_, facing_, *this); }

  LaneVoxelColours colour(int direction, bool upper) const {
    const End* ends = upper ? upper_ : lower_;
    LaneVoxelColours colours;
    for (int k = 0; k < kLanes; ++k) {
      const VoxelColour* brick = ends[k].bricks[direction][ends[k].brick];
      brick = brick == nullptr ? kNoColours : brick;
      int32_t colour;
      std::memcpy(&colour, brick + ends[k].in_brick, sizeof(colour));
      colours.word.v[k] = colour;
    }
    return colours;
  }

  SampleOf<LaneFloats> sample(int direction, bool upper) const {
    const End* ends = upper ? upper_ : lower_;
    LaneInts first, state;
    for (int k = 0; k < kLanes; ++k) {
      const Voxel* array = ends[k].arrays[direction];
      array = array == nullptr ? kNoVoxels : array;
      int32_t words[2];
      std::memcpy(words, array + ends[k].voxel, sizeof(words));
      first.v[k] = words[0];
      state.v[k] = words[1];
    }
    return VoxelRow(first, state).samples(least_evidence_);
  }

 private:
  /// Where its colours and its voxels lie, by direction.
  struct End {
    const VoxelColour* const (*bricks)[kBricksPerArray];
    const Voxel* const* arrays;
    int32_t brick, in_brick, voxel;
  };
  static End endAt(const ColouredCorners& corners, const CornerSource& at) {
    return {corners.colours[at.block], corners.voxels.array[at.block], brickOf(at.voxel),
            placeInBrick(at.voxel), at.voxel};
  }

  End lower_[kLanes], upper_[kLanes];
  LaneInts asked_, facing_;
  int32_t least_evidence_;
};

/// As colourOf() of each.
void storeColours(const ColourMeanOf<LaneFloats>& mean, int count, VertexColour* colours) {
  const RgbOf<LaneFloats> rgb = roundedMean(mean);
  const LaneInts red = cutOff(rgb.red), green = cutOff(rgb.green), blue = cutOff(rgb.blue);
  const LaneInts painted = mean.weight > LaneFloats(0.0f);
  for (int k = 0; k < count; ++k) {
    colours[k] = {static_cast<uint8_t>(red.v[k] & painted.v[k]),
                  static_cast<uint8_t>(green.v[k] & painted.v[k]),
                  static_cast<uint8_t>(blue.v[k] & painted.v[k]),
                  static_cast<uint8_t>(painted.v[k])};
  }
}

/// The painted voxels of one brick's corners.
void enterPainted(int block, int direction, int brick, PaintedCorners& corners) {
  const VoxelColour* const of_brick = corners.colours[block][direction][brick];
  const Vec3i first =
      firstVoxelOfBlock(cornerBlockOffset(block)) + voxelOffset(voxelInBrick(brick, 0));
  const auto end = [](int at) { return std::min(kBrickSide, kCornerGridSide - at); };
  for (int z = 0; z < end(first.z); ++z) {
    for (int y = 0; y < end(first.y); ++y) {
      const VoxelColour* const of_row = of_brick + kBrickSide * (y + kBrickSide * z);
      uint32_t painted = 0;
      for (int x = 0; x < kBrickSide; ++x) painted |= (isPainted(of_row[x]) ? 1u : 0u) << x;
      corners.rows[direction][first.z + z][first.y + y] |=
          static_cast<uint16_t>(painted << first.x);
    }
  }
}

PaintedCorners paintedCorners(const ColouredCorners& coloured) {
  PaintedCorners corners = {coloured, {}};
  for (int n = 0; n < kCornerBlocks; ++n) {
    for (int brick = 0; brick < kBricksPerArray; ++brick) {
      visitDirections(corners.kept[n][brick], [&](int d) { enterPainted(n, d, brick, corners); });
    }
  }
  return corners;
}

/// The first `count` vertices, which are those of edges.
void colourEdges(const ColouredCorners& corners, const std::vector<BlockVertex>& vertices,
                 size_t count, bool directional, std::vector<VertexColour>& colours) {
  withWidestVectors([&] {
    for (size_t first = 0; first < count; first += kLanes) {
      const int lanes = static_cast<int>(std::min<size_t>(kLanes, count - first));
      const EdgeLanes edges(corners, vertices.data() + first, lanes, directional);
      storeColours(edges.mean(), lanes, colours.data() + first);
    }
  });
  std::optional<PaintedCorners> painted;
  for (size_t i = 0; i < count; ++i) {
    if (colours[i].painted != 0) continue;
    if (!painted) painted = paintedCorners(corners);
    colours[i] = colourBeside(*painted, static_cast<int>(vertices[i].edge), directional);
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

ColouredCorners colouredCorners(const MeshedMap& map, const BlockKey& key, int32_t least_evidence) {
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
