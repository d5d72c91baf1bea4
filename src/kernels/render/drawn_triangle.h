/// Rasterises mesh triangles: finds the pixels that a triangle covers in a camera's image, and
/// their depths, normals and colours.
///
/// Corners are rounded to 1/256 of a pixel, and coverage is computed in integers. A pixel centre on
/// the side between two triangles that face the camera is covered by exactly one of them, so a
/// closed mesh shows no slit.
#pragma once

#include <cstring>

#include "kernels/colour/vertex_colour.h"
#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/core/select.h"
#include "kernels/core/vec.h"

namespace dtsdf {

/// A pixel of a view: the depth's bits in the upper half, the packed normal or colour in the lower.
/// The smallest key belongs to the nearest surface.
using ViewKey = uint64_t;

/// Key of a pixel where nothing was drawn; larger than any other.
constexpr ViewKey kNothingSeen = ~ViewKey{0};

/// The bits of a positive depth; they sort in the same order as depths.
DTSDF_HD uint32_t depthBits(float depth) {
  uint32_t bits;
  memcpy(&bits, &depth, sizeof(bits));
  return bits;
}

DTSDF_HD ViewKey viewKey(float depth, uint32_t shown) {
  return static_cast<ViewKey>(depthBits(depth)) << 32 | shown;
}

/// Whether a surface at this depth may be in front of the surface in a key.
DTSDF_HD bool mayBeBefore(float depth, ViewKey key) {
  return depthBits(depth) <= static_cast<uint32_t>(key >> 32);
}

/// Depth in voxels along the optical axis; 0 if there is no surface.
DTSDF_HD float depthOf(ViewKey key) {
  const uint32_t bits = key == kNothingSeen ? 0u : static_cast<uint32_t>(key >> 32);
  float depth;
  memcpy(&depth, &bits, sizeof(depth));
  return depth;
}

/// Normals are stored in octahedral encoding, with 16 bits for each of the two coordinates.
constexpr float kNormalSteps = 65535.0f;

DTSDF_HD float signOf(float a) { return select(a < 0.0f, -1.0f, 1.0f); }

/// Packs a normal of any length; a zero normal faces the camera.
DTSDF_HD uint32_t packNormal(const Vec3f& normal_C) {
  const float length = fabsf(normal_C.x) + fabsf(normal_C.y) + fabsf(normal_C.z);
  float x = 0.0f, y = 0.0f;
  if (length > 0.0f) {
    x = normal_C.x / length;
    y = normal_C.y / length;
    if (normal_C.z > 0.0f) {
      const float folded = (1.0f - fabsf(y)) * signOf(x);
      y = (1.0f - fabsf(x)) * signOf(y);
      x = folded;
    }
  }
  const auto step = [](float at) {
    return static_cast<uint32_t>((0.5f * at + 0.5f) * kNormalSteps + 0.5f);
  };
  return step(x) << 16 | step(y);
}

/// Unpacks a unit normal. Branch-free, which is faster.
DTSDF_HD Vec3f unpackNormal(uint32_t packed) {
  const auto place = [](uint32_t step) {
    return static_cast<float>(static_cast<int32_t>(step)) * (2.0f / kNormalSteps) - 1.0f;
  };
  const float x = place(packed >> 16), y = place(packed & 0xffffu);
  const float z = fabsf(x) + fabsf(y) - 1.0f;
  const Vec3f normal{select(z > 0.0f, (1.0f - fabsf(y)) * signOf(x), x),
                     select(z > 0.0f, (1.0f - fabsf(x)) * signOf(y), y), z};
  return (1.0f / norm(normal)) * normal;
}

DTSDF_HD uint32_t packColour(const VertexColour& colour) {
  return static_cast<uint32_t>(colour.red) << 24 | static_cast<uint32_t>(colour.green) << 16 |
         static_cast<uint32_t>(colour.blue) << 8 | colour.painted;
}

DTSDF_HD VertexColour unpackColour(uint32_t packed) {
  return {static_cast<uint8_t>(packed >> 24), static_cast<uint8_t>(packed >> 16),
          static_cast<uint8_t>(packed >> 8), static_cast<uint8_t>(packed)};
}

/// The normal or colour in a key; 0 if nothing was drawn.
DTSDF_HD Vec3f normalOf(ViewKey key) {
  const Vec3f normal = unpackNormal(static_cast<uint32_t>(key));
  return select(key == kNothingSeen, 0.0f, 1.0f) * normal;
}
DTSDF_HD VertexColour colourOf(ViewKey key) {
  return unpackColour(key == kNothingSeen ? 0u : static_cast<uint32_t>(key));
}

/// Maximum distance of a vertex from its block's centre, in voxels; see BlockVertex.
constexpr float kDrawnReach = 11.3f;
/// Maximum distance from a block's centre to a vertex that depends on the UnitLabels of the block.
/// The vertex may belong to a neighbouring block.
constexpr float kLabelledReach = kDrawnReach + 13.9f;

/// Whether anything within `reach` of a block's centre may be in view; false only if nothing is.
DTSDF_HD bool mayReachView(const FrameView& frame, const BlockKey& block_L, float reach) {
  constexpr float kMiddle = 0.5f * (kBlockSide - 1);
  return mayBeInView(frame, toFloat(firstVoxelOfBlock(block_L)) + Vec3f{kMiddle, kMiddle, kMiddle},
                     reach);
}

constexpr int32_t kPixelSteps = 256;

struct ProjectedVertex {
  int32_t x, y;         ///< In steps; pixel centres are at multiples of kPixelSteps.
  float inverse_depth;  ///< Per voxel; 0 if behind the camera or too near it.
  Vec3f normal_C;       ///< Not normalised; see normalOfShares().
};

/// Projects a point of the local frame, in voxels. The normal is left 0.
DTSDF_HD ProjectedVertex projectVertex(const FrameView& frame, const Vec3f& p_L) {
  constexpr float kMinDepth = 0.1f;        // in voxels
  constexpr float kFarthest = 2097152.0f;  // pixels; products of steps fit in 64 bits
  const Vec3f p = rotateInverse(frame.T_L_C, p_L - frame.T_L_C.t);
  if (!(p.z > kMinDepth)) return {0, 0, 0.0f, {0.0f, 0.0f, 0.0f}};
  const auto steps = [](float at) {
    const float inside = minimum(maximum(at, -kFarthest), kFarthest);
    return floorToInt(inside * static_cast<float>(kPixelSteps) + 0.5f);
  };
  const Intrinsics& K = frame.intrinsics;
  return {steps(K.fx * (p.x / p.z) + K.cx),
          steps(K.fy * (p.y / p.z) + K.cy),
          1.0f / p.z,
          {0.0f, 0.0f, 0.0f}};
}

/// A triangle's contribution to its vertices' normals, weighted by area; in integers, so that sums
/// do not depend on the order of addition.
DTSDF_HD Vec3i normalShare(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  constexpr float kSteps = 65536.0f;
  const Vec3f normal = cross(b - a, c - a);
  const auto steps = [](float at) { return floorToInt(at * kSteps + 0.5f); };
  return {steps(normal.x), steps(normal.y), steps(normal.z)};
}

/// The normal of a vertex, from the sum of its triangles' contributions. Not normalised, so that at
/// a border, a vertex with only a sliver of a triangle has little influence.
DTSDF_HD Vec3f normalOfShares(const FrameView& frame, const Vec3i& sum) {
  return rotateInverse(frame.T_L_C, toFloat(sum));
}

/// The weights of a triangle's corners at a point, not normalised: of[k] is twice the area between
/// the point and the side opposite corner k, in squared steps.
struct CornerWeights {
  int64_t of[3];
};

/// The pixels that a triangle covers.
struct DrawnTriangle {
  int32_t u0, v0, u1, v1;     ///< Bounding box, in pixels.
  CornerWeights first;        ///< At pixel (u0, v0).
  CornerWeights right, down;  ///< Change from one pixel to the next.
  /// Minimum weights of a covered pixel: 0 if pixel centres on that side belong to this triangle,
  /// otherwise 1.
  int64_t least[3];
  bool is_drawn;  ///< Whether it faces the camera and may cover a pixel.
};

DTSDF_HD int32_t min3(int32_t a, int32_t b, int32_t c) {
  const int32_t least = a < b ? a : b;
  return least < c ? least : c;
}
DTSDF_HD int32_t max3(int32_t a, int32_t b, int32_t c) {
  const int32_t greatest = a > b ? a : b;
  return greatest > c ? greatest : c;
}

/// Sets up a triangle whose corners are counter-clockwise when viewed from the front.
DTSDF_HD DrawnTriangle drawTriangle(const FrameView& frame, const ProjectedVertex& a,
                                    const ProjectedVertex& b, const ProjectedVertex& c) {
  DrawnTriangle drawn{};
  if (a.inverse_depth == 0.0f || b.inverse_depth == 0.0f || c.inverse_depth == 0.0f) return drawn;
  // `last` is the last pixel at or before a coordinate, `first` the first pixel at or after it.
  const auto last = [](int32_t at) { return at >> 8; };
  const auto first = [](int32_t at) { return (at + kPixelSteps - 1) >> 8; };
  static_assert(kPixelSteps == 1 << 8, "");
  drawn.u0 = max3(first(min3(a.x, b.x, c.x)), 0, 0);
  drawn.v0 = max3(first(min3(a.y, b.y, c.y)), 0, 0);
  drawn.u1 = min3(last(max3(a.x, b.x, c.x)), frame.width - 1, frame.width - 1);
  drawn.v1 = min3(last(max3(a.y, b.y, c.y)), frame.height - 1, frame.height - 1);
  if (drawn.u0 > drawn.u1 || drawn.v0 > drawn.v1) return drawn;
  // Image rows run downwards, so corners are taken in reverse to give triangles that face the
  // camera a positive area.
  const ProjectedVertex* const corner[3] = {&a, &b, &c};
  int64_t area = 0;
  for (int k = 0; k < 3; ++k) {
    const ProjectedVertex &from = *corner[(k + 2) % 3], &to = *corner[(k + 1) % 3];
    const int64_t dx = int64_t{to.x} - from.x, dy = int64_t{to.y} - from.y;
    const int64_t x = int64_t{drawn.u0} * kPixelSteps - from.x;
    const int64_t y = int64_t{drawn.v0} * kPixelSteps - from.y;
    drawn.first.of[k] = dx * y - dy * x;
    drawn.right.of[k] = -dy * kPixelSteps;
    drawn.down.of[k] = dx * kPixelSteps;
    drawn.least[k] = dy < 0 || (dy == 0 && dx > 0) ? 0 : 1;
    area += drawn.first.of[k];
  }
  drawn.is_drawn = area > 0;
  return drawn;
}

/// Weights at the pixel at an offset of (right, down) from the first pixel.
DTSDF_HD CornerWeights weightsAt(const DrawnTriangle& drawn, int32_t right, int32_t down) {
  CornerWeights weights;
  for (int k = 0; k < 3; ++k) {
    weights.of[k] = drawn.first.of[k] + right * drawn.right.of[k] + down * drawn.down.of[k];
  }
  return weights;
}

DTSDF_HD bool covers(const DrawnTriangle& drawn, const CornerWeights& weights) {
  return weights.of[0] >= drawn.least[0] && weights.of[1] >= drawn.least[1] &&
         weights.of[2] >= drawn.least[2];
}

/// The point where a pixel's ray meets a triangle: weights of the corners, not normalised, and the
/// depth in voxels.
struct TrianglePlace {
  float share[3];
  float depth;
};

/// Perspective-correct, as inverse depth is linear in the image.
DTSDF_HD TrianglePlace placeOn(const ProjectedVertex& a, const ProjectedVertex& b,
                               const ProjectedVertex& c, const CornerWeights& weights) {
  const auto in_image = [&](int k) { return static_cast<float>(weights.of[k]); };
  TrianglePlace place{
      {in_image(0) * a.inverse_depth, in_image(1) * b.inverse_depth, in_image(2) * c.inverse_depth},
      0.0f};
  const float sum = place.share[0] + place.share[1] + place.share[2];
  place.depth = (in_image(0) + in_image(1) + in_image(2)) / sum;
  return place;
}

DTSDF_HD uint32_t normalAt(const ProjectedVertex& a, const ProjectedVertex& b,
                           const ProjectedVertex& c, const TrianglePlace& place) {
  return packNormal(place.share[0] * a.normal_C + place.share[1] * b.normal_C +
                    place.share[2] * c.normal_C);
}

/// The weighted mean colour of the painted corners.
DTSDF_HD uint32_t colourAt(const VertexColour& a, const VertexColour& b, const VertexColour& c,
                           const TrianglePlace& place) {
  const VertexColour colour[3] = {a, b, c};
  ColourMean mean;
  for (int k = 0; k < 3; ++k) {
    if (colour[k].painted == 0) continue;
    mean.red += place.share[k] * static_cast<float>(colour[k].red);
    mean.green += place.share[k] * static_cast<float>(colour[k].green);
    mean.blue += place.share[k] * static_cast<float>(colour[k].blue);
    mean.weight += place.share[k];
  }
  return packColour(colourOf(mean));
}

}  // namespace dtsdf
