// Which cubes of cells an image may see.
#include <algorithm>

#include "kernels/space/see_free.h"
#include "space/space_map.h"

namespace dtsdf {
namespace {

/// Times the range: an image of 120 degrees along its diagonal has its corners there.
constexpr float kMostAside = 2.0f;

}  // namespace

std::vector<Vec3i> SpaceMap::cubesInView(const FrameView& frame) const {
  const BlockExtent bounds = inBoth(boundsOfView(frame), extent_);
  const auto side = static_cast<float>(cubeSideInVoxels(grid_));
  const float radius = 0.8661f * side;  // half the root of 3
  const float range = max_range_m_ / frame.voxel_size_m;
  const float* const R = frame.T_L_C.R;
  const Vec3f ahead{R[2], R[5], R[8]};
  std::vector<Vec3i> keys;
  for (int32_t z = bounds.first.z; z <= bounds.last.z; ++z) {
    for (int32_t y = bounds.first.y; y <= bounds.last.y; ++y) {
      for (int32_t x = bounds.first.x; x <= bounds.last.x; ++x) {
        const Vec3i cube{x, y, z};
        const Vec3f middle =
            lookAt(frame, grid_, cube).first_L + 0.5f * side * Vec3f{1.0f, 1.0f, 1.0f};
        if (dot(ahead, middle - frame.T_L_C.t) - radius > range) continue;
        if (mayBeInView(frame, middle, radius)) keys.push_back(cube);
      }
    }
  }
  return keys;
}

/// Bounds of the pyramid that the image looks into, cut off where an image looks so far aside that
/// it would go on for ever.
BlockExtent SpaceMap::boundsOfView(const FrameView& frame) const {
  const float range = max_range_m_ / frame.voxel_size_m;
  const Vec3f& eye = frame.T_L_C.t;
  Vec3f low = eye, high = eye;
  for (int corner = 0; corner < 4; ++corner) {
    const float u = corner % 2 == 0 ? -0.5f : static_cast<float>(frame.width) - 0.5f;
    const float v = corner / 2 == 0 ? -0.5f : static_cast<float>(frame.height) - 0.5f;
    const Vec3f p = transform(frame.T_L_C, backProject(frame.intrinsics, u, v, range));
    low = leastOf(low, p);
    high = greatestOf(high, p);
  }
  const float aside = kMostAside * range;
  const auto cubeOf = [&](float x, float y, float z) {
    const Vec3i voxel = frame.origin_voxel + Vec3i{floorToInt(x), floorToInt(y), floorToInt(z)};
    const Vec3i cube = shiftDown(voxel, grid_.side_log2 + kCubeSideLog2);
    const auto within = [](int32_t at) {
      return std::clamp(at, -kMaxBlockCoordinate, kMaxBlockCoordinate);
    };
    return Vec3i{within(cube.x), within(cube.y), within(cube.z)};
  };
  return {cubeOf(maximum(low.x, eye.x - aside), maximum(low.y, eye.y - aside),
                 maximum(low.z, eye.z - aside)),
          cubeOf(minimum(high.x, eye.x + aside), minimum(high.y, eye.y + aside),
                 minimum(high.z, eye.z + aside))};
}

}  // namespace dtsdf
