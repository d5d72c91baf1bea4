/// The stage "align" on the CPU: what an image's points say of its pose.
#pragma once

#include <vector>

#include "backend/pose_solver.h"
#include "cpu/voxel_store.h"
#include "dtsdf_mapping/depth_frame.h"
#include "kernels/poses/alignment_sums.h"
#include "kernels/surfels/depth.h"
#include "map/block_table.h"

namespace dtsdf {

class PoseAligner {
 public:
  PoseAligner(const AlignmentSettings& settings, bool directional, int threads)
      : settings_(settings), directional_(directional), threads_(threads) {}

  /// Takes the points of an image.
  void takePoints(const DepthFrame& frame, const FrameView& view, const DepthRange& range);

  /// The sums of these points at another pose of the same image.
  AlignmentSums sumsAt(const FrameView& view, float cutoff, const CpuMap& map) const;

  /// Blocks that these sums may look at, each once.
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
