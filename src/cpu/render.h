/// The stage "render" on the CPU: views of the map from any pose.
#pragma once

#include <vector>

#include "cpu/ray_units.h"
#include "dtsdf_mapping/rendered_view.h"
#include "kernels/render/between_rays.h"

namespace dtsdf {

struct TileImage {
  std::vector<TileRange> ranges;
  int32_t columns = 0;
};

/// Casts rays, each from where its tile's range begins, and fills what lies between them.
class Renderer {
 public:
  Renderer(const MeshedMap& map, const MeshRules& rules, bool directional, int threads)
      : map_(map), rules_(rules), directional_(directional), threads_(threads) {}

  /// Renders the surfaces of voxels with so much evidence.
  /// @param painted Whether the view has colours.
  void render(const FrameView& frame, int32_t least_evidence, bool painted, RenderedView& view);

  size_t bytes() const;

 private:
  void findBlocksInView(const FrameView& frame);
  void findRanges(const RayScene& scene);
  void lookAtBlock(const RayScene& scene, size_t number, TileImage& tiles);
  const TileRange& rangeAt(const Pixel& pixel) const;
  RenderedPixel& pixelAt(const FrameView& frame, const Pixel& pixel);
  void cast(const RayScene& scene, const Pixel& pixel, RayUnits& units);
  void castLattice(const RayScene& scene, int32_t v, RayUnits& units);
  bool fillSquare(const FrameView& frame, const Pixel& square, int32_t stride);
  void fillFirstSquares(const RayScene& scene, int32_t v, RayUnits& units);
  void fillOpenSquares(const RayScene& scene, int32_t v, RayUnits& units);
  void handOut(const FrameView& frame, int32_t v, RenderedView& view) const;
  void castRays(const RayScene& scene, RenderedView& view);

  const MeshedMap map_;
  const MeshRules rules_;
  const bool directional_;
  const int threads_;
  std::vector<int32_t> slots_;           ///< Of the blocks in view.
  std::vector<int32_t> number_of_slot_;  ///< Their places in that list; kNotInView.
  std::vector<VoxelBits> bits_;          ///< Of the blocks in view.
  std::vector<TileImage> tiles_;         ///< Per thread; the first one has it all then.
  std::vector<RenderedPixel> pixels_;
  std::vector<std::vector<Pixel>> open_squares_;  ///< Whose rays meet no plane, by rows of squares.
  RayBlocks blocks_;
};

}  // namespace dtsdf
