/// The stage "see free" on the CPU: finds the free-space cells that a depth image shows to be free.
#pragma once

#include <algorithm>
#include <vector>

#include "kernels/space/see_free.h"
#include "kernels/surfels/sensing.h"
#include "space/space_map.h"
#include "threads/parallel.h"

namespace dtsdf {

class FreeCellFinder {
 public:
  explicit FreeCellFinder(const MapperParams& params, int threads)
      : cell_log2_(cellLog2Of(params)),
        max_range_m_(params.space.max_range_m),
        threads_(threads),
        levels_(kFreeLevels) {}

  /// Returns the cells of `cubes` that are free according to the image; omits cubes without any.
  /// @pre The frame has free depths.
  std::vector<CubeMask> find(const FrameSensing& sensing, const std::vector<Vec3i>& cubes) {
    const FrameView& frame = sensing.image.frame;
    const FreePyramid free = makePyramid(sensing);
    std::vector<CubeMask> seen(cubes.size());
    parallelFor(cubes.size(), threads_, [&](size_t i) {
      const Vec3f first_L = cornerOfCube(frame, cell_log2_, cubes[i]);
      VoxelInImage corners[kCornersPerCube];
      for (int k = 0; k < kCornersPerCube; ++k) {
        corners[k] = cornerInImage(frame, first_L, cell_log2_, k);
      }
      seen[i] = {cubes[i], {}};
      for (int cell = 0; cell < kCellsPerCube; ++cell) {
        if (isCellSeenFree(free, corners, cell, max_range_m_)) add(seen[i].cells, cell);
      }
    });
    seen.erase(std::remove_if(seen.begin(), seen.end(),
                              [](const CubeMask& cube) { return isEmpty(cube.cells); }),
               seen.end());
    return seen;
  }

  size_t bytes() const {
    size_t bytes = 0;
    for (const auto& level : levels_) bytes += level.capacity() * sizeof(float);
    return bytes;
  }

 private:
  FreePyramid makePyramid(const FrameSensing& sensing) {
    const FrameView& frame = sensing.image.frame;
    FreePyramid free{{sensing.free_depth}, frame.width, frame.height};
    for (int k = 1; k < kFreeLevels; ++k) {
      const int32_t width = texelsFor(frame.width, k), height = texelsFor(frame.height, k);
      const int32_t width_below = texelsFor(frame.width, k - 1),
                    height_below = texelsFor(frame.height, k - 1);
      levels_[k].resize(static_cast<size_t>(width) * height);
      parallelFor(height, height < 64 ? 1 : threads_, [&](size_t v) {
        for (int32_t u = 0; u < width; ++u) {
          levels_[k][v * width + u] =
              minBelow(free.level[k - 1], width_below, height_below, u, static_cast<int32_t>(v));
        }
      });
      free.level[k] = levels_[k].data();
    }
    return free;
  }

  const int32_t cell_log2_;
  const float max_range_m_;
  const int threads_;
  /// Levels of the pyramid. Level 0 stays empty, as sensing.free_depth is used in its place.
  std::vector<std::vector<float>> levels_;
};

}  // namespace dtsdf
