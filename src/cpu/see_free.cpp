#include "cpu/see_free.h"

#include <algorithm>

#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

/// Where all corners of a cube's cells are seen; found side by side, so that compilers turn it into
/// vector instructions.
class SeenCorners {
 public:
  void compute(const FrameView& view, const CubeLook& look) {
    const FrameView frame = view;  // a copy of its own, which no result can overlap
    for (int z = 0; z < kCornersAlong; ++z) {
      for (int y = 0; y < kCornersAlong; ++y) {
        const int row = cubeCornerIndex(0, y, z);
        for (int x = 0; x < kCornersAlong; ++x) {
          const VoxelInImage at = cornerInImage(frame, look, x, y, z);
          depth_m_[row + x] = at.depth_m;
          u_[row + x] = at.u;
          v_[row + x] = at.v;
        }
      }
    }
  }

  VoxelInImage operator()(int x, int y, int z) const {
    const int i = cubeCornerIndex(x, y, z);
    return {depth_m_[i], u_[i], v_[i]};
  }

 private:
  float depth_m_[kCornersPerCube], u_[kCornersPerCube], v_[kCornersPerCube];
};

}  // namespace

FreeSeer::FreeSeer(const MapperParams& params, int threads)
    : grid_(cellGridOf(params)),
      max_range_m_(params.space.max_range_m),
      threads_(threads),
      levels_(kFreeLevels) {}

FreePyramid FreeSeer::makePyramid(const FrameSensing& sensing) {
  const FrameView& frame = sensing.image.frame;
  FreePyramid free{{sensing.free_depth}, frame.width, frame.height};
  struct NoScratch {};
  for (int k = 1; k < kFreeLevels; ++k) {
    const int32_t width = texelsFor(frame.width, k), height = texelsFor(frame.height, k);
    const int32_t width_below = texelsFor(frame.width, k - 1),
                  height_below = texelsFor(frame.height, k - 1);
    levels_[k].resize(static_cast<size_t>(width) * height);
    parallelFor<NoScratch>(height, height < 64 ? 1 : threads_, [&](size_t v, NoScratch&) {
      for (int32_t u = 0; u < width; ++u) {
        levels_[k][v * width + u] = leastBelow(free.level[k - 1], width_below, height_below, u,
                                               static_cast<int32_t>(v));
      }
    });
    free.level[k] = levels_[k].data();
  }
  return free;
}

std::vector<FreeCube> FreeSeer::see(const FrameSensing& sensing, const std::vector<Vec3i>& cubes) {
  const FrameView& frame = sensing.image.frame;
  const FreePyramid free = makePyramid(sensing);
  std::vector<FreeCube> seen(cubes.size());
  parallelFor<SeenCorners>(cubes.size(), threads_, [&](size_t i, SeenCorners& corners) {
    seen[i] = {cubes[i], {}};
    corners.compute(frame, lookAt(frame, grid_, cubes[i]));
    for (int cell = 0; cell < kCellsPerCube; ++cell) {
      if (isCellSeenFree(free, corners, cell, max_range_m_)) add(seen[i].free, cell);
    }
  });
  seen.erase(std::remove_if(seen.begin(), seen.end(),
                            [](const FreeCube& cube) { return isEmpty(cube.free); }),
             seen.end());
  return seen;
}

size_t FreeSeer::bytes() const {
  size_t bytes = 0;
  for (const auto& level : levels_) bytes += level.capacity() * sizeof(float);
  return bytes;
}

}  // namespace dtsdf
