/// The stage "align" on the CPU: selects points of an image, and sums their normal equations.
#pragma once

#include <algorithm>
#include <mutex>
#include <vector>

#include "backend/frame_check.h"
#include "backend/pose_solver.h"
#include "cpu/voxel_store.h"
#include "dtsdf_mapping/depth_frame.h"
#include "kernels/poses/alignment_sums.h"
#include "kernels/poses/voxel_reader.h"
#include "kernels/surfels/depth.h"
#include "map/block_table.h"
#include "threads/parallel.h"

namespace dtsdf {

/// Number of points that a thread processes at a time.
constexpr size_t kPointsAtOnce = 256;

inline void add(AlignmentSums& sums, const AlignmentSums& part) {
  for (int i = 0; i < kPoseTerms; ++i) sums.normal[i] += part.normal[i];
  for (int i = 0; i < 6; ++i) sums.right[i] += part.right[i];
  sums.squares += part.squares;
  sums.weight += part.weight;
  sums.points += part.points;
  sums.matched += part.matched;
  sums.inliers += part.inliers;
}

class PoseAligner {
 public:
  PoseAligner(const AlignmentSettings& settings, bool directional, int threads)
      : settings_(settings), directional_(directional), threads_(threads) {}

  /// Selects the points of an image for sumsAt().
  void takePoints(const DepthFrame& frame, const FrameView& view, const DepthRange& range) {
    const AlignmentGrid grid = alignmentGrid(view, settings_.rules);
    points_.resize(static_cast<size_t>(grid.columns) * grid.rows);
    parallelFor(static_cast<size_t>(grid.rows), threads_, [&](size_t row) {
      for (int32_t i = 0; i < grid.columns; ++i) {
        const auto index = static_cast<int32_t>(row) * grid.columns + i;
        const Pixel pixel = pixelOfPoint(grid, index);
        points_[index] = makeAlignedPoint(view, pixel, settings_, [&](int32_t du, int32_t dv) {
          return inverseDepth(rawDepth(frame, pixel.u + du, pixel.v + dv), range);
        });
      }
    });
  }

  /// Returns the sums over the points selected by takePoints().
  /// @param view The image's camera, at any pose.
  /// @param cutoff Limit for the residual of an inlier, and distance within which surfaces are
  /// searched for, in voxels.
  AlignmentSums sumsAt(const FrameView& view, float cutoff, const CpuMap& map) const {
    AlignmentSums sums{};
    std::mutex mutex;
    const size_t batches = (points_.size() + kPointsAtOnce - 1) / kPointsAtOnce;
    const auto slotOf = [&](PackedKey key) { return map.table.find(key); };
    const auto arrayOf = [&](int32_t slot, int direction) {
      const int32_t array = map.table.block(slot).array[direction];
      return array == kNoArray ? nullptr : map.voxels.array(array);
    };
    parallelFor(batches, threads_, [&](size_t batch) {
      VoxelReader reader(view.origin_voxel, slotOf, arrayOf);
      const auto find = [&](const Vec3f& p_L, const Vec3f& normal) {
        return findSurface(p_L, normal, directional_, cutoff, reader);
      };
      AlignmentSums part{};
      const size_t end = std::min(points_.size(), (batch + 1) * kPointsAtOnce);
      for (size_t i = batch * kPointsAtOnce; i < end; ++i) {
        addPoint(part, view, points_[i], cutoff, find);
      }
      const std::lock_guard<std::mutex> lock(mutex);
      add(sums, part);
    });
    return sums;
  }

  /// Keys of the blocks that sumsAt() may read, without duplicates.
  std::vector<PackedKey> keysAt(const FrameView& view, float cutoff) const {
    return alignedKeys(view, cutoff, points_.data(), points_.size());
  }

 private:
  AlignmentSettings settings_;
  bool directional_;
  int threads_;
  std::vector<AlignedPoint> points_;
};

}  // namespace dtsdf
