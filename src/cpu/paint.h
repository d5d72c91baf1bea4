/// The stage "paint" on the CPU: a colour image onto the surfaces that it sees.
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

/// Takes the colour from those of a block's voxels, of some directions, a bit each, that hold
/// nothing any more: what comes there next has a colour of its own.
void forgetColours(const BlockEntry& entry, uint32_t directions, CpuMap& map);

/// Paints an image in steps: takes it, looks at what it shows, and paints that, once the bricks of
/// colours are there that it needs.
class Painter {
 public:
  Painter(const PaintSettings& settings, int threads) : settings_(settings), threads_(threads) {}

  /// Takes an image, which is not needed any more on return.
  void takeImage(const ColourFrame& frame);

  /// Finds what it shows of the map's surfaces.
  SeenColours look(const FrameView& view, int32_t least_evidence,
                   const std::vector<int32_t>& in_view, CpuMap& map);

  /// The bricks that it is to be painted in.
  std::vector<ColourRequest> requests(CpuMap& map) const;

  /// Paints what was found, as far as there are bricks of colours for it.
  /// @return the slots of the blocks that look different now.
  std::vector<int32_t> paint(const Exposure& exposure, CpuMap& map);

  size_t bytes() const;

 private:
  /// What the image says of one block; its voxels are direction times kVoxelsPerBlock + voxel.
  struct BlockView {
    int32_t slot;
    std::vector<std::pair<uint16_t, SurfacePoint>> points;   ///< Of voxels that face the camera.
    std::vector<std::pair<uint16_t, ColourSample>> samples;  ///< Of voxels that it shows.
    uint64_t bricks;                                         ///< That these lie in, a bit each.
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
  std::vector<ColourPixel> pixels_;           ///< The image in all its sizes.
  std::vector<std::vector<float>> hiding_m_;  ///< One per thread, merged into the first.
  std::vector<BlockView> blocks_;             ///< Those in view first.
  size_t blocks_in_view_ = 0;
};

}  // namespace dtsdf
