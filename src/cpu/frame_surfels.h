/// Depth image to surfels, and to how far it saw free space, on the CPU.
#pragma once

#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {

/// Computes the surfels of a frame; the buffers are kept from frame to frame.
class FrameSurfels {
 public:
  /// One surfel per pixel, in the image's order, as voxel projection looks them up; weight 0 where
  /// there is none. @return number of surfels with a weight.
  size_t computePixels(const DepthFrame& frame, const FrameView& view, const MapperParams& params,
                       int threads);

  /// One surfel per group, pixel, or part of a pixel, for casting: those with a weight, in no order
  /// that matters. @return their number.
  size_t computeGroups(const DepthFrame& frame, const FrameView& view, const MapperParams& params,
                       int threads);

  const std::vector<Surfel>& surfels() const { return surfels_; }
  /// freeDepth() per pixel; after computeGroups().
  const float* freeDepth() const { return free_depth_.data(); }
  size_t bytes() const;

  /// Standard deviation of the last frame's inverse depth, in 1/m.
  float noise() const { return noise_; }

 private:
  void fitRows(const DepthFrame& frame, const FrameView& view, const MapperParams& params,
               int threads);
  template <class IsWanted, class Visit>
  void visitColumnFits(const FrameView& view, const NormalFitSettings& settings, int u, int v,
                       const IsWanted& is_wanted, const Visit& visit) const;
  void computeFreeDepth(const FrameView& view, const MapperParams& params, int threads);
  /// Appends the surfels of the tiles whose first row is `first_v`.
  void computeTiles(const FrameView& view, const MapperParams& params, int first_v,
                    std::vector<TileGroups>& tiles, std::vector<Surfel>& surfels) const;
  FitImages images() const {
    return {inverse_depth_.data(), row_value_.data(), row_slope_.data()};
  }

  float noise_ = 0.0f;
  std::vector<float> inverse_depth_, row_value_, row_slope_, free_depth_;
  std::vector<Surfel> surfels_;
  std::vector<std::vector<Surfel>> rows_of_tiles_;
};

}  // namespace dtsdf
