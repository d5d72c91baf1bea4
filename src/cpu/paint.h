/// The stage "paint" on the CPU: paints a colour image onto the surfaces visible in it.
#pragma once

#include <utility>
#include <vector>

#include "backend/map_backend.h"
#include "cpu/voxel_store.h"
#include "dtsdf_mapping/colour_frame.h"
#include "kernels/colour/colour_rules.h"
#include "kernels/colour/paint.h"
#include "map/block_table.h"

namespace dtsdf {

/// Removes the colours of a block's empty voxels in `directions` (one bit each), so that surfaces
/// that appear there in future do not inherit the colours.
void forgetColours(const BlockEntry& entry, uint32_t directions, CpuMap& map);

/// Paints an image in three steps: takeImage(), findColours(), and paint() after the bricks for its
/// colours have been created.
class Painter {
 public:
  Painter(const PaintSettings& settings, int threads) : settings_(settings), threads_(threads) {}

  /// Copies an image, which may then be freed.
  void takeImage(const ColourFrame& frame);

  /// Finds the surfaces of the map that are visible in the image.
  SeenColours findColours(const FrameView& view, int32_t min_evidence,
                          const std::vector<int32_t>& in_view, CpuMap& map);

  /// The bricks required to paint the image.
  std::vector<ColourRequest> requests(CpuMap& map) const;

  /// Paints the surfaces found by findColours(), where bricks exist.
  /// @return the slots of the blocks whose colours changed visibly.
  std::vector<int32_t> paint(const Exposure& exposure, CpuMap& map);

  size_t bytes() const;

 private:
  /// The visible part of a block. The index of a voxel is direction * kVoxelsPerBlock + its index
  /// in the array.
  struct BlockView {
    int32_t slot;
    std::vector<std::pair<uint16_t, SurfacePoint>> points;   ///< Points that face the camera.
    std::vector<std::pair<uint16_t, ColourSample>> samples;  ///< Samples of visible points.
    uint64_t bricks;  ///< Bricks of the samples, one bit each.
    ExposureSums sums;
  };

  void findBlocksInView(const std::vector<int32_t>& candidates, const BlockTable& table);
  void findPoints(CpuMap& map);
  void findPoints(CpuMap& map, BlockView& block, float* hiding_m) const;
  void sample(BlockView& block) const;
  void prefetchNext(CpuMap& map, size_t i) const;
  void sumExposure(CpuMap& map, BlockView& block) const;
  bool paintBlock(const Exposure& exposure, CpuMap& map, const BlockView& block) const;
  Vec3f firstVoxelOf(const BlockEntry& entry) const;

  const PaintSettings settings_;
  const int threads_;
  ColourSensing sensing_ = {};
  std::vector<ColourPixel> pixels_;           ///< The image at all resolutions.
  std::vector<std::vector<float>> hiding_m_;  ///< Per thread, a depth image for occlusion tests.
  std::vector<BlockView> blocks_;             ///< Blocks in view come first.
  size_t blocks_in_view_ = 0;
};

}  // namespace dtsdf
