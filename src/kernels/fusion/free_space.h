/// Finds voxels whose surface is contradicted by a depth image, because the image looks through it.
///
/// Casting along lines writes only near surfaces, so without clearing, stray measurements and
/// removed objects would stay. Voxel projection also writes in front of surfaces, and needs no
/// clearing.
///
/// A voxel is tested at its place. This is the anchor if the frame covers the voxel (a covered
/// voxel without an anchor is not tested), the voxel itself if it has no distance, and otherwise
/// its foot (its nearest point on the surface). The frame contradicts the voxel if the 3 x 3 points
/// around the place are free, not counting points outside the image. So nothing is contradicted
/// next to an outline or a thin object, or where the free depth is unknown. At an outline, a
/// support may be revoked (contradicts()).
#pragma once

#include "kernels/core/anchor.h"
#include "kernels/core/direction.h"
#include "kernels/core/select.h"
#include "kernels/fusion/evidence.h"
#include "kernels/fusion/free_patches.h"
#include "kernels/fusion/sample_line.h"

namespace dtsdf {

/// The inputs from which a pixel's plane is computed: its inverse depth, its row fit, the row fits
/// of the pixels above and below (0 outside the image), its links and the links of the pixel above.
struct PlaneAround {
  float inverse_depth;
  float row_value, row_slope, above, below;
  PixelLinks links, links_above;
};

DTSDF_HD PlaneAround planeAround(const ImageView& image, const Pixel& pixel) {
  const int64_t at = pixelIndex(image.frame, pixel), width = image.frame.width;
  const bool has_above = pixel.v > 0, has_below = pixel.v < image.frame.height - 1;
  return {image.inverse_depth[at],
          image.row_value[at],
          image.row_slope[at],
          has_above ? image.row_value[at - width] : 0.0f,
          has_below ? image.row_value[at + width] : 0.0f,
          image.links[at],
          has_above ? image.links[at - width] : PixelLinks{0}};
}

/// Depth in metres up to which a pixel's ray is free: the pixel's depth minus a margin
/// (perpendicular to the pixel's plane, if there is one); 0 if nothing is measured or the margin
/// exceeds the depth. Measurements beyond the fused range are used too; an unfilled gap counts as
/// measured at its nearest neighbour's depth (filledInverseDepth()). Branch-free, for
/// vectorisation.
DTSDF_HD float freeDepth(const FrameSensing& sensing, const Pixel& pixel, const PlaneAround& plane,
                         const FusionSettings& fusion) {
  const FrameView& frame = sensing.image.frame;
  const float inverse_depth = fabsf(plane.inverse_depth);
  const float depth_m = 1.0f / inverse_depth;
  const float margin_m =
      frame.voxel_size_m *
      (fusion.rules.free_margin + fusion.noise_level * noiseInVoxels(sensing, depth_m));
  // The slope down the column is computed from the row fits of linked pixels.
  const int32_t to_above = (plane.above > 0.0f) & ((plane.links_above & kLinkDown) != 0);
  const int32_t to_below = (plane.below > 0.0f) & ((plane.links & kLinkDown) != 0);
  const float upper = plane.row_value - plane.above, lower = plane.below - plane.row_value;
  const float from_above = to_below != 0 ? 0.5f * (upper + lower) : upper;
  // With the plane 1 / z = n^T (x, y, 1), a point at depth z on the pixel's ray is (1 - z / depth)
  // / |n| away from the plane.
  const Intrinsics& K = frame.intrinsics;
  const float slope_u = plane.row_slope, slope_v = to_above != 0 ? from_above : lower;
  const Vec3f n{K.fx * slope_u, K.fy * slope_v,
                1.0f / depth_m - (static_cast<float>(pixel.u) - K.cx) * slope_u -
                    (static_cast<float>(pixel.v) - K.cy) * slope_v};
  const bool has_plane = (plane.row_value > 0.0f) & ((to_above | to_below) != 0);
  const float free_m = depth_m - (has_plane ? margin_m * norm(n) * depth_m : margin_m);
  return (inverse_depth > 0.0f) & (free_m > 0.0f) ? free_m : 0.0f;
}

DTSDF_HD float freeDepth(const FrameSensing& sensing, const Pixel& pixel,
                         const FusionSettings& fusion) {
  return freeDepth(sensing, pixel, planeAround(sensing.image, pixel), fusion);
}

/// Mean slope of the distance towards a voxel's two neighbours along an axis, or the slope towards
/// the only neighbour with a distance; 0 if neither has one. `has_upper` and `has_lower` are 1 if
/// the neighbour has a distance, otherwise 0.
template <class Real>
DTSDF_HD Real slopeBeside(const Real& own, const Real& upper, const Real& has_upper,
                          const Real& lower, const Real& has_lower) {
  return (Real{1.0f} - Real{0.5f} * (has_upper * has_lower)) *
         (has_upper * (upper - own) + has_lower * (own - lower));
}

/// Slope of the distance at a voxel along an axis, per voxel, computed from its neighbours in the
/// block; 0 if there are none. Branch-free, since branches on whether a neighbour has a distance
/// would be unpredictable.
DTSDF_HD float slopeAlong(const Voxel* voxels, int index, int axis) {
  const int at = component(voxelOffset(index), axis);
  const int step = axis == 0 ? 1 : (axis == 1 ? kBlockSide : kBlockSide * kBlockSide);
  const int32_t to_upper = at<kBlockSide - 1, to_lower = at> 0;
  const Voxel upper = voxels[index + to_upper * step], lower = voxels[index - to_lower * step];
  const auto has_upper = static_cast<float>(to_upper & static_cast<int32_t>(!isEmpty(upper)));
  const auto has_lower = static_cast<float>(to_lower & static_cast<int32_t>(!isEmpty(lower)));
  return slopeBeside(sdfOf(voxels[index]), sdfOf(upper), has_upper, sdfOf(lower), has_lower);
}

DTSDF_HD Vec3f slopeAt(const Voxel* voxels, int index) {
  return {slopeAlong(voxels, index, 0), slopeAlong(voxels, index, 1), slopeAlong(voxels, index, 2)};
}

/// Stands for the only array of an undirected map, which holds surfaces of all orientations.
constexpr int kAnyDirection = -1;

/// Limits the orientation of surfaces in a voxel array: their normals must have at least this
/// cosine with the axis.
struct Facing {
  Vec3f axis;
  float min_cosine;
};

DTSDF_HD Facing facingOf(int direction) {
  constexpr float kMinCosine = 0.3f;
  if (direction == kAnyDirection) return {{0.0f, 0.0f, 0.0f}, -1.0f};
  const float sign = directionSign(direction);
  const int axis = directionAxis(direction);
  return {{axis == 0 ? sign : 0.0f, axis == 1 ? sign : 0.0f, axis == 2 ? sign : 0.0f}, kMinCosine};
}

/// Unit gradient of the distance at a voxel. If the slope is too small or does not match the
/// direction, the direction's axis is returned. In the undirected map, 0 is returned instead, so
/// that the voxel is its own foot.
DTSDF_HD Vec3f gradientOf(const Vec3f& slope, const Facing& facing) {
  constexpr float kMinLength = 0.3f;
  const float length = norm(slope);
  const auto has_slope = static_cast<float>(
      static_cast<int32_t>(length > kMinLength) &
      static_cast<int32_t>(dot(slope, facing.axis) > facing.min_cosine * length));
  const float has_none = 1.0f - has_slope, scale = has_slope / (has_slope * length + has_none);
  return scale * slope + has_none * facing.axis;
}

/// A voxel's foot, in voxels relative to the block's first voxel.
DTSDF_HD Vec3f footOf(const Vec3f& voxel, float sdf, const Vec3f& slope, const Facing& facing) {
  return voxel - sdf * gradientOf(slope, facing);
}

/// Whether a frame can change a voxel by looking through its place; works on one voxel or several
/// at once. A covered voxel needs an anchor. A voxel that is not covered must be in a block that is
/// checked in this frame (`in_turn`) and, if it is empty, its evidence must be above the minimum
/// (`may_lose`, which implies `in_turn`).
template <class Mask>
DTSDF_HD Mask canChange(const Mask& is_covered, const Mask& has_anchor, const Mask& is_empty,
                        const Mask& may_lose, const Mask& in_turn) {
  return select(is_covered, has_anchor, select(is_empty, may_lose, in_turn));
}

DTSDF_HD bool isJudged(const Voxel& voxel, bool is_covered, bool in_turn,
                       const FusionRules& rules) {
  const bool may_lose = in_turn && evidenceOf(voxel) > -rules.max_evidence;
  return canChange(is_covered, voxel.anchor != kNoAnchor, isEmpty(voxel), may_lose, in_turn);
}

/// The point from which the step to a voxel's place starts: the voxel's anchor if the frame covers
/// the voxel, otherwise the voxel itself. In voxels relative to the block's first voxel.
DTSDF_HD Vec3f judgedOrigin(uint16_t anchor, int index, bool is_covered) {
  const float to_anchor = is_covered ? 1.0f : 0.0f;
  return toFloat(voxelOffset(index)) + to_anchor * anchorOffset(anchor);
}

/// Length of the step from judgedOrigin() to the voxel's place, against the gradient, in voxels;
/// may be negative.
DTSDF_HD float judgedSdf(const Voxel& voxel, bool is_covered) {
  return is_covered ? 0.0f : sdfOf(voxel);
}

/// A voxel's place, in voxels relative to the block's first voxel.
DTSDF_HD Vec3f placeOf(const Voxel* voxels, int index, int direction, bool is_covered) {
  const Voxel& voxel = voxels[index];
  return footOf(judgedOrigin(voxel.anchor, index, is_covered), judgedSdf(voxel, is_covered),
                slopeAt(voxels, index), facingOf(direction));
}

/// Spacing in pixels of the 3 x 3 points at which a frame must look through a place. It is 1 unless
/// the voxel is empty. An empty voxel represents all mesh units around it, so its spacing is the
/// width of a voxel, rounded down but at least 1.
DTSDF_HD int probeSpacing(const FrameView& frame, const Voxel& voxel, float depth_m) {
  if (!isEmpty(voxel)) return 1;
  const float cell_px = frame.voxel_size_m * frame.intrinsics.fx / depth_m;
  return cell_px < 1.0f ? 1 : floorToInt(minimum(cell_px, 1000.0f));
}

/// Whether the frame looks through a place at all 3 x 3 points around it, `spread` pixels apart.
/// Points outside the image are ignored.
DTSDF_HD bool seesThroughAround(const FrameSensing& sensing, const VoxelInImage& at, int spread) {
  const FrameView& frame = sensing.image.frame;
  const Pixel centre{static_cast<int>(at.u), static_cast<int>(at.v)};
  const int left = centre.u >= spread ? centre.u - spread : centre.u;
  const int right = centre.u + spread < frame.width ? centre.u + spread : centre.u;
  bool free = true;
  for (int dv = -spread; dv <= spread; dv += spread) {
    const int v = centre.v + dv;
    if (v < 0 || v >= frame.height) continue;
    const float* row = sensing.free_depth + static_cast<int64_t>(v) * frame.width;
    free &= (at.depth_m < row[left]) & (at.depth_m < row[centre.u]) & (at.depth_m < row[right]);
  }
  return free;
}

DTSDF_HD bool isInImage(const FrameView& frame, const VoxelInImage& at) {
  return (at.depth_m > 0.0f) & (at.u >= 0.0f) & (at.v >= 0.0f) &
         (at.u < static_cast<float>(frame.width)) & (at.v < static_cast<float>(frame.height));
}

/// What is observed at a voxel's place.
enum class Observation : uint32_t {
  kOccupied,   ///< A surface may be there, or the place is not in the image.
  kAtOutline,  ///< Free at the place's own pixel, but not at all pixels around it.
  kFree,       ///< Free at all pixels around the place.
};

/// The depth up to which a pixel must be free for the frame to look through a voxel's place: the
/// depth of the place, plus one voxel if the tested voxel is empty. Infinite outside the image.
DTSDF_HD float requiredFreeDepth(const FrameView& frame, bool is_empty, const VoxelInImage& at) {
  constexpr float kInfiniteDepth_m = 1e30f;
  const float depth_m = is_empty ? at.depth_m + frame.voxel_size_m : at.depth_m;
  return isInImage(frame, at) ? depth_m : kInfiniteDepth_m;
}

/// Index of the pixel that a place projects to; 0 outside the image. Branch-free, for
/// vectorisation.
DTSDF_HD int32_t pixelOfPlace(const FrameView& frame, const VoxelInImage& at) {
  const bool is_inside = isInImage(frame, at);
  const auto u = static_cast<int32_t>(is_inside ? at.u : 0.0f);
  const auto v = static_cast<int32_t>(is_inside ? at.v : 0.0f);
  return v * frame.width + u;
}

/// The observation at a place whose own pixel is free.
DTSDF_HD Observation judgeFree(const FrameSensing& sensing, const Voxel& voxel,
                               const VoxelInImage& at) {
  const FrameView& frame = sensing.image.frame;
  const float depth_m = requiredFreeDepth(frame, isEmpty(voxel), at);
  return seesThroughAround(sensing, {depth_m, at.u, at.v}, probeSpacing(frame, voxel, at.depth_m))
             ? Observation::kFree
             : Observation::kAtOutline;
}

/// The observation at the place of a voxel; the place projects to `at`.
DTSDF_HD Observation judge(const FrameSensing& sensing, const Voxel& voxel,
                           const VoxelInImage& at) {
  const FrameView& frame = sensing.image.frame;
  const float free_m = sensing.free_depth[pixelOfPlace(frame, at)];
  return requiredFreeDepth(frame, isEmpty(voxel), at) < free_m ? judgeFree(sensing, voxel, at)
                                                               : Observation::kOccupied;
}

/// The observation at the place of a voxel for which isJudged() holds.
DTSDF_HD Observation judge(const FrameSensing& sensing, const Vec3f& first_voxel_L,
                           const Voxel* voxels, int index, int direction, bool is_covered) {
  const Vec3f place = placeOf(voxels, index, direction, is_covered);
  return judge(sensing, voxels[index], projectToImage(sensing.image.frame, first_voxel_L + place));
}

/// Whether an observation reduces a voxel's evidence. At an outline, only a support of a covered
/// voxel is revoked, so that a surface ends where as many images observe it as look past it. No
/// support is revoked if the evidence is almost at its maximum (isFull()): as a camera circles an
/// object, the object's outline passes over all of its surface and would erode it.
DTSDF_HD bool contradicts(Observation observation, const Voxel& voxel, bool is_covered,
                          const FusionRules& rules) {
  return observation == Observation::kFree ||
         (observation == Observation::kAtOutline && is_covered && !isFull(voxel, rules));
}

/// Number of contradictions that an observation counts as. A voxel that is not covered is checked
/// in one out of look_turns frames, so each check counts look_turns times.
DTSDF_HD int32_t contradictionWeight(Observation observation, bool is_covered,
                                     const FusionRules& rules) {
  if (observation != Observation::kFree) return 0;
  return is_covered ? 1 : rules.look_turns;
}

/// Whether a frame checks a block's uncovered voxels. Each block is checked in one out of
/// look_turns frames.
DTSDF_HD bool isInTurn(PackedKey key, uint64_t frame_number, const FusionRules& rules) {
  const auto turns = static_cast<uint64_t>(rules.look_turns);
  return (hashKey(key) >> 32) % turns == frame_number % turns;
}

/// Radius, in voxels, of a ball around a block's centre that contains the feet of its voxels: 7 for
/// the block itself, plus at most 16 for the truncation distance.
constexpr float kFootRadius = 3.0f * static_cast<float>(kBlockSide);

/// Whether part of a ball around a block's centre may be in the image; false only if no part is.
DTSDF_HD bool mayBeInView(const FrameView& frame, const Vec3i& block_L,
                          float radius = kFootRadius) {
  constexpr float kHalf = 0.5f * static_cast<float>(kBlockSide);
  return mayBeInView(frame, toFloat(firstVoxelOfBlock(block_L)) + Vec3f{kHalf, kHalf, kHalf},
                     radius);
}

}  // namespace dtsdf
