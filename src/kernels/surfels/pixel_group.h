/// Which neighbouring pixels are fused as one surfel.
///
/// Where a voxel is many pixels wide, neighbouring pixels of a smooth surface update the very same
/// voxels with almost the same plane: their mean says the same for a fraction of the work. The image
/// is divided into tiles of 4 x 4 pixels. A tile is one group, or else each of its four quads of
/// 2 x 2 pixels is one, or else the quad's pixels stay single.
#pragma once

#include "kernels/surfels/normal_estimation.h"

namespace dtsdf {

constexpr int kTileSide = 4;  ///< In pixels.
constexpr int kQuadSide = 2;

/// Tiles along a side of the image; the last may reach beyond it.
DTSDF_HD int tilesAlong(int pixels) { return (pixels + kTileSide - 1) / kTileSide; }

struct GroupSettings {
  float depth_jump;   ///< Largest share by which depths on one surface may differ.
  float focal_px;
  float width_px_m;   ///< Largest width of a group, in pixels at 1 m.
  float range_m;      ///< Largest difference of depths in a group.
};

/// Widest group, and largest difference of the depths in it, in voxels.
constexpr float kGroupWidth = 0.45f, kGroupRange = 1.0f;

DTSDF_HD GroupSettings makeGroupSettings(float depth_jump, float focal_px, float voxel_size_m) {
  return {depth_jump, focal_px, kGroupWidth * focal_px * voxel_size_m, kGroupRange * voxel_size_m};
}

/// Largest turn of the surface from one side of a group to the other, in radians: at a crease the
/// pixels have to keep their own normals. Between single rows noise counts for more.
constexpr float kTurnAcross = 0.6f, kTurnDown = 1.2f;
/// Rows over which the slope above and below a group is taken.
constexpr int kRowsBeside = 3;

/// Whether the surface turns little along the rows of a square, from the slopes of the row fits.
DTSDF_HD bool turnsLittleAcross(const float* row_slope, int width, int side, float largest_turn) {
  float least = row_slope[0], most = row_slope[0];
  for (int y = 0; y < side; ++y, row_slope += width) {
    for (int x = 0; x < side; ++x) {
      least = minimum(least, row_slope[x]);
      most = maximum(most, row_slope[x]);
    }
  }
  return most - least <= largest_turn;
}

/// The same along the columns, from the values of the row fits above and below the square.
DTSDF_HD bool turnsLittleDown(const float* row_value, int width, int side, float largest_turn) {
  const int64_t last = static_cast<int64_t>(side - 1) * width;
  const int64_t beside = static_cast<int64_t>(kRowsBeside) * width;
  for (int x = 0; x < side; ++x) {
    const float* column = row_value + x;
    const float before = column[-beside], first = column[0];
    const float end = column[last], after = column[last + beside];
    if (!(before > 0.0f && first > 0.0f && end > 0.0f && after > 0.0f)) return false;
    const float turn = (first - before) - (after - end);
    if (!(fabsf(turn) <= largest_turn * static_cast<float>(kRowsBeside))) return false;
  }
  return true;
}

/// Whether the square of pixels with its first corner at (u, v) is one group: all measured, in
/// extent small against a voxel, and one smooth surface.
DTSDF_HD bool isGroup(const FitImages& images, int width, int height, int u, int v, int side,
                      const GroupSettings& settings) {
  if (u + side > width || v < kRowsBeside || v + side + kRowsBeside > height) return false;
  const int64_t first = static_cast<int64_t>(v) * width + u;
  const float* row = images.inverse_depth + first;
  float least = row[0], most = row[0];
  if (!(static_cast<float>(side) <= settings.width_px_m * least)) return false;
  for (int y = 0; y < side; ++y, row += width) {
    for (int x = 0; x < side; ++x) {
      least = minimum(least, row[x]);
      most = maximum(most, row[x]);
    }
  }
  const float range = most - least;  // the range of z is this by least * most
  if (!(static_cast<float>(side) <= settings.width_px_m * least) ||
      !depthsConnected(least, most, settings.depth_jump) ||
      !(range <= settings.range_m * least * most)) {
    return false;
  }
  const float radian = most / settings.focal_px;  // as a slope of 1 / z, for a frontal surface
  return turnsLittleAcross(images.row_slope + first, width, side, kTurnAcross * radian) &&
         turnsLittleDown(images.row_value + first, width, side, kTurnDown * radian);
}

/// How a tile is divided: bit kTileBit if it is one group, else bit q for each quad that is one.
using TileGroups = uint32_t;
constexpr int kTileBit = 4;

DTSDF_HD TileGroups groupTile(const FitImages& images, int width, int height, int u, int v,
                              const GroupSettings& settings) {
  if (isGroup(images, width, height, u, v, kTileSide, settings)) return 1u << kTileBit;
  TileGroups groups = 0;
  for (int q = 0; q < 4; ++q) {
    const int quad_u = u + kQuadSide * (q & 1), quad_v = v + kQuadSide * (q >> 1);
    if (quad_u < width && isGroup(images, width, height, quad_u, quad_v, kQuadSide, settings)) {
      groups |= 1u << q;
    }
  }
  return groups;
}

/// Side of the group that a pixel is the first of, 1 for a single pixel; 0 for the other pixels of
/// a group.
DTSDF_HD int groupSide(TileGroups groups, int u, int v) {
  const int x = u & (kTileSide - 1), y = v & (kTileSide - 1);
  if (groups >> kTileBit & 1) return x == 0 && y == 0 ? kTileSide : 0;
  const int quad = (x >> 1) + 2 * (y >> 1);
  if (groups >> quad & 1) return (x & 1) == 0 && (y & 1) == 0 ? kQuadSide : 0;
  return 1;
}

}  // namespace dtsdf
