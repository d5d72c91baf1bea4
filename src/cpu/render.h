/// The stage "render" on the CPU: views of the map from any pose.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "cpu/block_mesher.h"
#include "cpu/block_surface.h"
#include "dtsdf_mapping/rendered_view.h"
#include "kernels/render/drawn_triangle.h"

namespace dtsdf {

/// The nearest that was drawn into each pixel of an image, by many threads at once.
class DrawnImage {
 public:
  /// Nothing is drawn.
  void clear(size_t pixels);

  ViewKey at(size_t pixel) const { return keys_[pixel].load(std::memory_order_relaxed); }
  void draw(size_t pixel, ViewKey key);
  /// @pre No thread draws.
  const ViewKey* data() const { return reinterpret_cast<const ViewKey*>(keys_.get()); }

  size_t bytes() const { return room_ * sizeof(ViewKey); }

 private:
  std::unique_ptr<std::atomic<ViewKey>[]> keys_;
  size_t room_ = 0;
};

/// Makes the triangles of the blocks in view, and draws them.
class Renderer {
 public:
  Renderer(const CpuMap& map, BlockMesher& mesher, int threads)
      : map_(map), mesher_(mesher), threads_(threads) {}

  /// Renders the surfaces of voxels with so much evidence.
  /// @param painted Whether the view has colours.
  void render(const FrameView& frame, int32_t least_evidence, bool painted, RenderedView& view);

  size_t bytes() const { return surfaces_.bytes() + colours_.bytes(); }

 private:
  /// What a thread needs to draw one block after the other.
  struct Scratch {
    BlockSurface surface;
    std::vector<Vec3i> shares;
    std::vector<SeenVertex> vertices;
  };

  std::vector<int32_t> slotsWithin(const FrameView& frame, float reach) const;
  void drawBlock(const FrameView& frame, const BlockMesh& mesh, bool painted, Scratch& scratch);

  const CpuMap& map_;
  BlockMesher& mesher_;
  const int threads_;
  DrawnImage surfaces_, colours_;
};

}  // namespace dtsdf
