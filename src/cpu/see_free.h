/// The stage "see free" on the CPU: which cells of space a depth image sees through.
#pragma once

#include <algorithm>
#include <vector>

#include "kernels/space/see_free.h"
#include "kernels/surfels/sensing.h"
#include "space/space_map.h"
#include "threads/parallel.h"

namespace dtsdf {

/// What pick() takes of the eight corners of each cell of a cube, axis by axis: cells share most of
/// their corners.
template <class Pick>
inline void pickForCells(const float* corners, const Pick& pick, float* cells) {
  constexpr int kA = kCornersAlong, kC = kCubeSide;
  float along_x[kC * kA * kA], along_xy[kC * kC * kA];
  for (int row = 0; row < kA * kA; ++row) {
    for (int x = 0; x < kC; ++x) {
      along_x[x + kC * row] = pick(corners[x + kA * row], corners[x + 1 + kA * row]);
    }
  }
  for (int z = 0; z < kA; ++z) {
    for (int i = 0; i < kC * kC; ++i) {
      const float* const plane = along_x + kC * kA * z;
      along_xy[i + kC * kC * z] = pick(plane[i], plane[i + kC]);
    }
  }
  for (int i = 0; i < kCellsPerCube; ++i) cells[i] = pick(along_xy[i], along_xy[i + kC * kC]);
}

/// What the cells of a cube cover in an image; found side by side, so that compilers turn it into
/// vector instructions.
class SeenCells {
 public:
  void compute(const FrameView& view, const CubeLook& look) {
    findCorners(view, look);
    const auto least = [](float a, float b) { return minimum(a, b); };
    const auto greatest = [](float a, float b) { return maximum(a, b); };
    pickForCells(depth_m_, least, near_m_);
    pickForCells(depth_m_, greatest, far_m_);
    pickForCells(u_, least, left_);
    pickForCells(u_, greatest, right_);
    pickForCells(v_, least, top_);
    pickForCells(v_, greatest, bottom_);
  }

  /// The same as boundsOfCell().
  SeenBounds operator[](int cell) const {
    return {near_m_[cell], far_m_[cell], left_[cell], right_[cell], top_[cell], bottom_[cell]};
  }

 private:
  void findCorners(const FrameView& view, const CubeLook& look) {
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

  float depth_m_[kCornersPerCube], u_[kCornersPerCube], v_[kCornersPerCube];
  float near_m_[kCellsPerCube], far_m_[kCellsPerCube];
  float left_[kCellsPerCube], right_[kCellsPerCube], top_[kCellsPerCube], bottom_[kCellsPerCube];
};

/// The buffers are kept from frame to frame.
class FreeCellFinder {
 public:
  explicit FreeCellFinder(const MapperParams& params, int threads)
      : grid_(cellGridOf(params)),
        max_range_m_(params.space.max_range_m),
        threads_(threads),
        levels_(kFreeLevels) {}

  /// Of those cubes, the ones of which something is seen free. @pre The frame has free depths.
  std::vector<FreeCube> find(const FrameSensing& sensing, const std::vector<Vec3i>& cubes) {
    const FrameView& frame = sensing.image.frame;
    const FreePyramid free = makePyramid(sensing);
    std::vector<FreeCube> seen(cubes.size());
    parallelFor<SeenCells>(cubes.size(), threads_, [&](size_t i, SeenCells& cells) {
      seen[i] = {cubes[i], {}};
      cells.compute(frame, lookAt(frame, grid_, cubes[i]));
      for (int cell = 0; cell < kCellsPerCube; ++cell) {
        if (isSeenFreeWithin(free, cells[cell], max_range_m_)) add(seen[i].free, cell);
      }
    });
    seen.erase(std::remove_if(seen.begin(), seen.end(),
                              [](const FreeCube& cube) { return isEmpty(cube.free); }),
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
              leastBelow(free.level[k - 1], width_below, height_below, u, static_cast<int32_t>(v));
        }
      });
      free.level[k] = levels_[k].data();
    }
    return free;
  }

  const CellGrid grid_;
  const float max_range_m_;
  const int threads_;
  std::vector<std::vector<float>> levels_;  ///< From the second one on.
};

}  // namespace dtsdf
