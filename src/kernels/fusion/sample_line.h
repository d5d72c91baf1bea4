/// Finds the samples that a surfel updates when it is cast into the grid, the blocks that contain
/// them, and their distances and weights.
///
/// The line runs through the surfel's point in both directions, along the view ray or the normal
/// (turned towards the ray if the depth is noisy). It is intersected with each grid plane
/// perpendicular to its dominant axis, and the four corners around the intersection are updated; no
/// corner is visited twice. Weights fall with the distance from the line (squared bilinear) and
/// from the surfel's plane (linear). The paper, however, updates the nearest corner at each step
/// (Amanatides and Woo 1987).
///
/// Each plane is computed independently, so that the part of a line inside one block can be
/// processed by itself.
#pragma once

#include "kernels/core/anchor.h"
#include "kernels/core/grid.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/surfels/surfel.h"

namespace dtsdf {

/// Maximum distance from the measured plane, in voxels, at which samples are updated.
DTSDF_HD float sampleReach(float noise_voxels, const FusionSettings& fusion) {
  return minimum(fusion.truncation_voxels,
                 maximum(fusion.rules.sample_reach, fusion.rules.noise_reach * noise_voxels));
}

/// Standard deviation of a depth, in voxels.
DTSDF_HD float noiseInVoxels(const FrameSensing& sensing, float depth_m) {
  const float noise = noiseAt(sensing.noise, 1.0f / depth_m);
  return noise * depth_m * depth_m / sensing.image.frame.voxel_size_m;
}

/// Half the sides of a wide pixel or subpixel on its plane, along the image's rows and columns.
/// They are given as vectors in voxels, in the axes (k, u, v) of the surfel's line, and as the
/// inverses of their squared lengths. All 0 if the surfel is a point.
struct MeasuredSides {
  Vec3f across, down;
  float per_across, per_down;

  DTSDF_HD bool areMeasured() const { return per_across + per_down > 0.0f; }
};

DTSDF_HD MeasuredSides noSides() { return {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, 0.0f, 0.0f}; }

/// A measured point's offset from a corner. The point is moved along `side`, by at most the length
/// of `side` in either direction, to where it is nearest to the corner.
DTSDF_HD Vec3f movedAlong(const Vec3f& side, float per_side, const Vec3f& offset) {
  const float share = minimum(maximum(-per_side * dot(offset, side), -1.0f), 1.0f);
  return offset + share * side;
}

/// A line in the grid with its axes permuted so that k is the dominant one: (k, u, v) is (x, y, z),
/// (y, z, x) or (z, x, y).
struct SampleLine {
  int32_t axis;
  /// Grid planes perpendicular to axis k that the line crosses within `reach`.
  int32_t first_plane, last_plane;
  float per_reach;                     ///< Inverse of `reach`; see makeSampleLine().
  float p_k, p_u, p_v;                 ///< Measured point.
  float slope_u, slope_v;              ///< Change of u and v per plane.
  float normal_k, normal_u, normal_v;  ///< Surface normal, for the point-to-plane distance.
};

/// `direction` is a unit vector. `reach`, in voxels, is how far the line extends to each side of
/// the point, and the distance from the surface at which weights become 0.
DTSDF_HD SampleLine makeSampleLine(const Vec3f& p, const Vec3f& normal, const Vec3f& direction,
                                   float reach) {
  const float ax = fabsf(direction.x), ay = fabsf(direction.y), az = fabsf(direction.z);
  SampleLine line;
  line.axis = (ax >= ay) & (ax >= az) ? 0 : (ay >= az ? 1 : 2);
  const int u = line.axis == 2 ? 0 : line.axis + 1, v = u == 2 ? 0 : u + 1;
  const float dk = component(direction, line.axis);
  line.p_k = component(p, line.axis);
  line.p_u = component(p, u);
  line.p_v = component(p, v);
  line.slope_u = component(direction, u) / dk;
  line.slope_v = component(direction, v) / dk;
  line.normal_k = component(normal, line.axis);
  line.normal_u = component(normal, u);
  line.normal_v = component(normal, v);
  line.per_reach = 1.0f / reach;
  line.first_plane = ceilToInt(line.p_k - reach * fabsf(dk));
  line.last_plane = floorToInt(line.p_k + reach * fabsf(dk));
  return line;
}

/// Converts grid coordinates (k, u, v) of a line back to (x, y, z).
DTSDF_HD Vec3i unpermute(int axis, int k, int u, int v) {
  return axis == 0 ? Vec3i{k, u, v} : (axis == 1 ? Vec3i{v, k, u} : Vec3i{u, v, k});
}

/// Bit positions in a point's key for the axes k, u and v of a line along `axis`.
DTSDF_HD Vec3i pointShifts(int axis) {
  const int u = axis == 2 ? 0 : axis + 1, v = u == 2 ? 0 : u + 1;
  return {pointShift(axis), pointShift(u), pointShift(v)};
}

/// The crossing of a line with one grid plane.
struct CellCrossing {
  int u, v;                         ///< The corner of the cell with the smallest u and v.
  float fraction_u, fraction_v;     ///< Position inside the cell, in [0, 1).
  float point_k, point_u, point_v;  ///< The measured point, relative to that corner.
  float distance;                   ///< Signed distance of that corner.
};

DTSDF_HD CellCrossing crossCell(const SampleLine& line, int plane) {
  const float step = static_cast<float>(plane) - line.p_k;
  const float at_u = line.p_u + step * line.slope_u, at_v = line.p_v + step * line.slope_v;
  const int u = floorToInt(at_u), v = floorToInt(at_v);
  const float point_k = line.p_k - static_cast<float>(plane),
              point_u = line.p_u - static_cast<float>(u),
              point_v = line.p_v - static_cast<float>(v);
  return {u,
          v,
          at_u - static_cast<float>(u),
          at_v - static_cast<float>(v),
          point_k,
          point_u,
          point_v,
          -(point_k * line.normal_k + point_u * line.normal_u + point_v * line.normal_v)};
}

/// The sample at a corner of a cell: the fraction of the surfel's weight that it receives, in [0,
/// 1]; its point-to-plane distance in voxels, positive in front of the surface; and the key of the
/// measured point (core/anchor.h).
struct CornerSample {
  float share, distance;
  uint32_t point_key;
};

/// The sample at the corner (du, dv), each 0 or 1, of a cell; `shifts` is from pointShifts(). If
/// the surfel has sides, the measured point is moved within the pixel towards the corner's foot, as
/// the surface continues to the next pixel. Contains no loops or branches, so that compilers can
/// vectorise loops that call it.
template <bool kHasSides>
DTSDF_HD CornerSample sampleCorner(const SampleLine& line, const MeasuredSides& sides,
                                   const Vec3i& shifts, const CellCrossing& at, int du, int dv) {
  const bool is_u = du != 0, is_v = dv != 0;
  const float bilinear =
      (is_u ? at.fraction_u : 1.0f - at.fraction_u) * (is_v ? at.fraction_v : 1.0f - at.fraction_v);
  const float distance =
      at.distance + ((is_u ? line.normal_u : 0.0f) + (is_v ? line.normal_v : 0.0f));
  const float nearness = 1.0f - fabsf(distance) * line.per_reach;
  Vec3f offset{at.point_k, is_u ? at.point_u - 1.0f : at.point_u,
               is_v ? at.point_v - 1.0f : at.point_v};
  if (kHasSides) {
    offset =
        movedAlong(sides.down, sides.per_down, movedAlong(sides.across, sides.per_across, offset));
  }
  return {(bilinear * bilinear) * maximum(nearness, 0.0f), distance,
          pointKey(offset, shifts, distance)};
}

/// A range of voxels or blocks along one axis, including both ends.
struct Span {
  int32_t first, last;
};

/// The corners along one axis that are updated if a line crosses a plane at `corner` + `fraction`
/// on that axis.
DTSDF_HD Span cornersOf(int corner, float fraction) {
  return {corner, corner + (fraction > 0.0f ? 1 : 0)};
}

DTSDF_HD Span blocksOf(const Span& a, const Span& b) {
  const int first = a.first < b.first ? a.first : b.first, last = a.last > b.last ? a.last : b.last;
  return {first >> kBlockSideLog2, last >> kBlockSideLog2};
}

DTSDF_HD bool contains(const Span& span, int at) { return span.first <= at && at <= span.last; }

/// Whether a line has samples in block (block_u, block_v) of the layer of blocks that contains
/// `planes`.
DTSDF_HD bool hasSamplesIn(const SampleLine& line, const Span& planes, int block_u, int block_v) {
  for (int plane = planes.first; plane <= planes.last; ++plane) {
    const CellCrossing at = crossCell(line, plane);
    const Span u = cornersOf(at.u, at.fraction_u), v = cornersOf(at.v, at.fraction_v);
    if (contains(blocksOf(u, u), block_u) && contains(blocksOf(v, v), block_v)) return true;
  }
  return false;
}

/// Calls visit(block) once for each block that contains samples of a line, in local block
/// coordinates. In a layer of blocks, the line's two ends bound the range of blocks; if this range
/// extends along both u and v, some of its blocks may contain no samples.
template <class Visit>
DTSDF_HD void visitBlocks(const SampleLine& line, const Visit& visit) {
  if (line.first_plane > line.last_plane) return;
  const int last_layer = line.last_plane >> kBlockSideLog2;
  for (int layer = line.first_plane >> kBlockSideLog2; layer <= last_layer; ++layer) {
    const int begin = layer * kBlockSide, end = begin + kBlockSide - 1;
    const Span planes{line.first_plane > begin ? line.first_plane : begin,
                      line.last_plane < end ? line.last_plane : end};
    const CellCrossing a = crossCell(line, planes.first), b = crossCell(line, planes.last);
    const Span u = blocksOf(cornersOf(a.u, a.fraction_u), cornersOf(b.u, b.fraction_u));
    const Span v = blocksOf(cornersOf(a.v, a.fraction_v), cornersOf(b.v, b.fraction_v));
    const bool takes_all = u.first == u.last || v.first == v.last;
    for (int block_u = u.first; block_u <= u.last; ++block_u) {
      for (int block_v = v.first; block_v <= v.last; ++block_v) {
        if (takes_all || hasSamplesIn(line, planes, block_u, block_v)) {
          visit(unpermute(line.axis, layer, block_u, block_v));
        }
      }
    }
  }
}

}  // namespace dtsdf
