/// The stage "paint" on the CPU: paints a colour image onto the surfaces that it shows.
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

/// Removes the colours of a block's empty voxels in `directions` (one bit each), so that later
/// surfaces do not inherit the colours.
void forgetColours(const BlockEntry& entry, uint32_t directions, CpuMap& map);

/// Paints an image in steps: takeImage(), findColours(), and paint() when the bricks for its
/// colours exist.
class Painter {
 public:
  Painter(const PaintSettings& settings, int threads) : settings_(settings), threads_(threads) {}

  /// Copies an image; it may be freed on return.
  void takeImage(const ColourFrame& frame);

  /// Finds the map's surfaces that the image shows.
  SeenColours findColours(const FrameView& view, int32_t min_evidence,
                          const std::vector<int32_t>& in_view, CpuMap& map);

  /// The bricks that painting the image needs.
  std::vector<ColourRequest> requests(CpuMap& map) const;

  /// Paints the surfaces that findColours() found, where bricks exist.
  /// @return the slots of the blocks that look different now.
  std::vector<int32_t> paint(const Exposure& exposure, CpuMap& map);

  size_t bytes() const;

 private:
  /// What the image shows of a block. Voxels are numbered direction * kVoxelsPerBlock + index.
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
  std::vector<ColourPixel> pixels_;           ///< The image at all levels.
  std::vector<std::vector<float>> hiding_m_;  ///< Depths for hiding, per thread.
  std::vector<BlockView> blocks_;             ///< Blocks in view come first.
  size_t blocks_in_view_ = 0;
};

}  // namespace dtsdf
