/// A ray through the units of the map, up to the first surface that faces the camera.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/render/depth_range.h"
#include "kernels/render/ray_unit.h"

namespace dtsdf {

/// From the camera, in voxels of the local frame; `step` leads one voxel farther in depth.
struct Ray {
  Vec3f origin_L, step_L;
  Vec3f per_step;  ///< One by the components of `step_L`; 0 where they are 0.
};

DTSDF_HD Ray rayOf(const FrameView& frame, const Pixel& pixel) {
  const Vec3f way_C =
      backProject(frame.intrinsics, static_cast<float>(pixel.u), static_cast<float>(pixel.v), 1.0f);
  const Vec3f step = rotate(frame.T_L_C, way_C);
  const auto inverse = [](float x) { return x != 0.0f ? 1.0f / x : 0.0f; };
  return {frame.T_L_C.t, step, {inverse(step.x), inverse(step.y), inverse(step.z)}};
}

DTSDF_HD Vec3f pointOn(const Ray& ray, float depth) { return ray.origin_L + depth * ray.step_L; }

/// Where a ray meets a surface.
struct RayHit {
  float depth;     ///< In voxels; 0: nowhere.
  Vec3i unit;      ///< In the local frame.
  Vec3f at;        ///< In the unit, in [0, 1]^3.
  Vec3f normal_L;  ///< Of length one.
};

DTSDF_HD RayHit noHit() { return {0.0f, {0, 0, 0}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}}; }

/// Depth at which a ray leaves the coordinates from `first` on along one axis.
DTSDF_HD float depthAtEnd(float origin, float per_step, int32_t first, int32_t side) {
  constexpr float kNever = 1e30f;
  const float plane = static_cast<float>(per_step > 0.0f ? first + side : first);
  return per_step != 0.0f ? (plane - origin) * per_step : kNever;
}

/// The way out of a cube of units: depth, and the axis of the face.
struct CubeExit {
  float depth;
  int axis;
};

DTSDF_HD CubeExit exitOf(const Ray& ray, const Vec3i& first, int32_t side) {
  const float x = depthAtEnd(ray.origin_L.x, ray.per_step.x, first.x, side);
  const float y = depthAtEnd(ray.origin_L.y, ray.per_step.y, first.y, side);
  const float z = depthAtEnd(ray.origin_L.z, ray.per_step.z, first.z, side);
  if (x <= y && x <= z) return {x, 0};
  return y <= z ? CubeExit{y, 1} : CubeExit{z, 2};
}

/// The unit behind a face of a cube of units. Along the face's axis it is the next one whatever
/// rounding does to the point; along the others it stays in the cube.
DTSDF_HD Vec3i unitBehind(const Ray& ray, const Vec3i& first, int32_t side, const CubeExit& exit) {
  const Vec3f p = pointOn(ray, exit.depth);
  const auto next = [&](int axis) {
    const int32_t low = component(first, axis), high = low + side - 1;
    if (axis == exit.axis) return component(ray.step_L, axis) > 0.0f ? high + 1 : low - 1;
    const int32_t at = floorToInt(component(p, axis));
    return at < low ? low : (at > high ? high : at);
  };
  return {next(0), next(1), next(2)};
}

/// Where a ray is on its way through a block, unit by unit.
struct UnitWalk {
  Vec3i at;    ///< The unit.
  Vec3f exit;  ///< Depths at which the ray leaves it, along each axis.
};

DTSDF_HD UnitWalk walkFrom(const Ray& ray, const Vec3i& at) {
  return {at,
          {depthAtEnd(ray.origin_L.x, ray.per_step.x, at.x, 1),
           depthAtEnd(ray.origin_L.y, ray.per_step.y, at.y, 1),
           depthAtEnd(ray.origin_L.z, ray.per_step.z, at.z, 1)}};
}

DTSDF_HD float nextExit(const UnitWalk& walk) {
  return minimum(walk.exit.x, minimum(walk.exit.y, walk.exit.z));
}

/// Along one axis: to the unit behind the face that the ray leaves through, if `leaves`.
/// @return whether that is of another block.
DTSDF_HD bool stepAlong(float origin, float step, float per_step, bool leaves, int32_t& at,
                        float& exit) {
  const int32_t before = at;
  at += leaves ? (step > 0.0f ? 1 : -1) : 0;
  exit = leaves ? depthAtEnd(origin, per_step, at, 1) : exit;
  return ((at ^ before) >> kBlockSideLog2) != 0;
}

/// To the next unit; of faces that are left at once, the first axis' comes first.
/// @return whether it is of another block.
DTSDF_HD bool step(const Ray& ray, UnitWalk& walk) {
  const Vec3f exit = walk.exit;
  const bool x = exit.x <= exit.y && exit.x <= exit.z;
  const bool y = exit.y < exit.x && exit.y <= exit.z;
  const bool z = !x && !y;
  const bool by_x =
      stepAlong(ray.origin_L.x, ray.step_L.x, ray.per_step.x, x, walk.at.x, walk.exit.x);
  const bool by_y =
      stepAlong(ray.origin_L.y, ray.step_L.y, ray.per_step.y, y, walk.at.y, walk.exit.y);
  const bool by_z =
      stepAlong(ray.origin_L.z, ray.step_L.z, ray.per_step.z, z, walk.at.z, walk.exit.z);
  return by_x || by_y || by_z;
}

DTSDF_HD float clampToUnit(float at) { return minimum(maximum(at, 0.0f), 1.0f); }

/// Where a point of the ray lies in a unit.
DTSDF_HD Vec3f placeIn(const Ray& ray, const Vec3i& unit, float depth) {
  const Vec3f p = pointOn(ray, depth) - toFloat(unit);
  return {clampToUnit(p.x), clampToUnit(p.y), clampToUnit(p.z)};
}

/// The part of a ray in a unit.
struct RayPart {
  float begin, end;
};

/// Depth of the zero between the ends of a part, where the distance is `front` >= 0 and `behind`
/// < 0: two steps of the false position. The distance is a cubic there, and almost a line.
DTSDF_HD float zeroIn(const RayUnit& unit, const Vec3i& at, const Ray& ray, RayPart part,
                      float front, float behind) {
  for (int step = 0; step < 2; ++step) {
    const float depth = part.begin + (part.end - part.begin) * (front / (front - behind));
    const float sdf = distanceIn(unit, placeIn(ray, at, depth));
    if (sdf < 0.0f) {
      part.end = depth;
      behind = sdf;
    } else {
      part.begin = depth;
      front = sdf;
    }
  }
  return part.begin + (part.end - part.begin) * (front / (front - behind));
}

DTSDF_HD RayHit hitAt(const RayUnit& unit, const Vec3i& at, const Ray& ray, float depth) {
  const Vec3f place = placeIn(ray, at, depth);
  Vec3f normal = gradientIn(unit, place);
  // At a rim the distance may fall along the ray and rise again: its gradient is no normal then.
  if (!(dot(normal, ray.step_L) < 0.0f)) normal = -1.0f * ray.step_L;
  return {depth, at, place, (1.0f / norm(normal)) * normal};
}

/// Looks for a surface in the part of a ray in a unit. `is_front` says whether the ray comes from
/// in front of one; it is set to whether it leaves so.
DTSDF_HD RayHit hitInUnit(const RayUnit& unit, const Vec3i& at, const Ray& ray, const RayPart& part,
                          bool& is_front) {
  const bool comes_from_front = is_front;
  is_front = unit.state == UnitState::kFront;
  if (unit.state != UnitState::kSurface) return noHit();
  const float begin = distanceIn(unit, placeIn(ray, at, part.begin));
  // Units that disagree about the corners between them leave no slit.
  if (begin < 0.0f && comes_from_front) return hitAt(unit, at, ray, part.begin);
  const float end = distanceIn(unit, placeIn(ray, at, part.end));
  is_front = end >= 0.0f;
  if (begin < 0.0f || is_front) return noHit();
  return hitAt(unit, at, ray, zeroIn(unit, at, ray, part, begin, end));
}

/// Follows a ray through a block, from a unit and a depth on, until it meets a surface, leaves the
/// block or gets to `far`.
template <class Units>
DTSDF_HD RayHit castThroughBlock(const Ray& ray, float far, Units& units, Vec3i& at, float& depth,
                                 bool& is_front) {
  UnitWalk walk = walkFrom(ray, at);
  bool leaves = false;
  while (!leaves && depth < far) {
    const float exit = nextExit(walk);
    const RayHit hit = hitInUnit(units.find(walk.at), walk.at, ray, {depth, exit}, is_front);
    if (hit.depth > 0.0f) return hit;
    leaves = step(ray, walk);
    depth = maximum(exit, depth);
  }
  at = walk.at;
  return noHit();
}

/// Follows a ray through a range of depths, in the local frame. `units.enter(block)` says whether
/// the map has a block, and `units.find(unit)` gives a RayUnit of the block entered last.
template <class Units>
DTSDF_HD RayHit castRay(const Ray& ray, const TileRange& range, Units& units) {
  float depth = range.near;
  const Vec3f begin = pointOn(ray, depth);
  Vec3i at{floorToInt(begin.x), floorToInt(begin.y), floorToInt(begin.z)};
  bool is_front = false;
  while (depth < range.far) {
    const Vec3i block = blockOfVoxel(at);
    if (units.enter(block)) {
      const RayHit hit = castThroughBlock(ray, range.far, units, at, depth, is_front);
      if (hit.depth > 0.0f) return hit;
      continue;
    }
    const Vec3i first = firstVoxelOfBlock(block);
    const CubeExit exit = exitOf(ray, first, kBlockSide);
    at = unitBehind(ray, first, kBlockSide, exit);
    depth = maximum(exit.depth, depth);
    is_front = false;
  }
  return noHit();
}

}  // namespace dtsdf
