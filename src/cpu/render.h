/// The stage "render" on the CPU: renders views of the map from any pose.
#pragma once

#include <algorithm>
#include <vector>

#include "backend/frame_check.h"
#include "cpu/block_mesher.h"
#include "cpu/block_surface.h"
#include "dtsdf_mapping/rendered_view.h"
#include "kernels/render/drawn_triangle.h"
#include "threads/parallel.h"

namespace dtsdf {

/// Reads the key of a pixel that other threads may be changing.
inline ViewKey drawnAt(const ViewKey& pixel) { return __atomic_load_n(&pixel, __ATOMIC_RELAXED); }

/// Draws a key unless the pixel already contains a nearer one. Thread-safe.
inline void draw(ViewKey& pixel, ViewKey key) {
  ViewKey found = drawnAt(pixel);
  while (key < found && !__atomic_compare_exchange_n(&pixel, &found, key, true, __ATOMIC_RELAXED,
                                                     __ATOMIC_RELAXED)) {
  }
}

/// Calls visit(pixel, weights) for each pixel that a triangle covers.
template <class Visit>
inline void visitPixels(const FrameView& frame, const DrawnTriangle& drawn, const Visit& visit) {
  for (int32_t v = drawn.v0; v <= drawn.v1; ++v) {
    CornerWeights weights = weightsAt(drawn, 0, v - drawn.v0);
    const auto row = static_cast<size_t>(pixelIndex(frame, {0, v}));
    for (int32_t u = drawn.u0; u <= drawn.u1; ++u) {
      if (covers(drawn, weights)) visit(row + static_cast<size_t>(u), weights);
      for (int k = 0; k < 3; ++k) weights.of[k] += drawn.right.of[k];
    }
  }
}

/// Projects a block's vertices, and computes their normals from the block's triangles.
inline std::vector<ProjectedVertex> projectVertices(const FrameView& frame, const BlockMesh& mesh) {
  std::vector<Vec3i> shares(mesh.vertices.size(), Vec3i{0, 0, 0});
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const uint16_t* corner = mesh.triangles.data() + i;
    const Vec3i share =
        normalShare(mesh.vertices[corner[0]].position, mesh.vertices[corner[1]].position,
                    mesh.vertices[corner[2]].position);
    for (int k = 0; k < 3; ++k) shares[corner[k]] = shares[corner[k]] + share;
  }
  const Vec3f first = toFloat(firstVoxelOfBlock(mesh.key) - frame.origin_voxel);
  std::vector<ProjectedVertex> seen;
  seen.reserve(mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    seen.push_back(projectVertex(frame, first + mesh.vertices[i].position));
    seen.back().normal_C = normalOfShares(frame, shares[i]);
  }
  return seen;
}

/// Fills rows [begin, end) of a view's images. `colours` may be null.
inline void fillRows(const FrameView& frame, int32_t begin, int32_t end, const ViewKey* surfaces,
                     const ViewKey* colours, RenderedView& view) {
  const auto first = static_cast<size_t>(pixelIndex(frame, {0, begin}));
  const auto last = static_cast<size_t>(pixelIndex(frame, {0, end}));
  for (size_t i = first; i < last; ++i) {
    view.depth_m[i] = frame.voxel_size_m * depthOf(surfaces[i]);
    view.normals_C[i] = normalOf(surfaces[i]);
  }
  if (colours == nullptr) return;
  for (size_t i = first; i < last; ++i) view.colours[i] = colourOf(colours[i]);
}

/// Draws the meshes of the blocks in view.
class Renderer {
 public:
  Renderer(const CpuMap& map, BlockMesher& mesher, int threads)
      : map_(map), mesher_(mesher), threads_(threads) {}

  /// Renders the surfaces of voxels with at least `min_evidence`.
  /// @param painted Whether to render colours.
  void render(const FrameView& frame, int32_t min_evidence, bool painted, RenderedView& view) {
    const size_t pixels = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
    surfaces_.assign(pixels, kNothingSeen);
    if (painted) colours_.assign(pixels, kNothingSeen);
    mesher_.labelBlocks(slotsWithin(frame, kLabelledReach), min_evidence);
    const std::vector<int32_t> slots = slotsWithin(frame, kDrawnReach);
    parallelFor<BlockSurface>(slots.size(), threads_, [&](size_t i, BlockSurface& surface) {
      const BlockMesh* mesh = mesher_.viewMesh(slots[i], surface);
      if (mesh != nullptr) drawBlock(frame, *mesh, painted);
    });
    resizeView(frame, painted, view);
    constexpr int32_t kRows = 16;
    const int32_t bands = (frame.height + kRows - 1) / kRows;
    parallelFor(static_cast<size_t>(bands), threads_, [&](size_t i) {
      const int32_t begin = static_cast<int32_t>(i) * kRows;
      fillRows(frame, begin, std::min(begin + kRows, frame.height), surfaces_.data(),
               painted ? colours_.data() : nullptr, view);
    });
  }

  size_t bytes() const { return (surfaces_.capacity() + colours_.capacity()) * sizeof(ViewKey); }

 private:
  std::vector<int32_t> slotsWithin(const FrameView& frame, float reach) const {
    const BlockKey origin = blockOfVoxel(frame.origin_voxel);
    std::vector<int32_t> slots = map_.table.slotsInView(frame, reach);
    const auto is_out_of_view = [&](int32_t slot) {
      return !mayReachView(frame, map_.table.block(slot).key - origin, reach);
    };
    slots.erase(std::remove_if(slots.begin(), slots.end(), is_out_of_view), slots.end());
    return slots;
  }

  void drawBlock(const FrameView& frame, const BlockMesh& mesh, bool painted) {
    const std::vector<ProjectedVertex> vertices = projectVertices(frame, mesh);
    for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
      const uint16_t* corner = mesh.triangles.data() + i;
      const ProjectedVertex& a = vertices[corner[0]];
      const ProjectedVertex& b = vertices[corner[1]];
      const ProjectedVertex& c = vertices[corner[2]];
      const DrawnTriangle drawn = drawTriangle(frame, a, b, c);
      if (!drawn.is_drawn) continue;
      visitPixels(frame, drawn, [&](size_t pixel, const CornerWeights& weights) {
        const TrianglePlace place = placeOn(a, b, c, weights);
        if (!mayBeBefore(place.depth, drawnAt(surfaces_[pixel]))) return;
        draw(surfaces_[pixel], viewKey(place.depth, normalAt(a, b, c, place)));
        if (!painted) return;
        draw(colours_[pixel],
             viewKey(place.depth, colourAt(mesh.colours[corner[0]], mesh.colours[corner[1]],
                                           mesh.colours[corner[2]], place)));
      });
    }
  }

  const CpuMap& map_;
  BlockMesher& mesher_;
  const int threads_;
  std::vector<ViewKey> surfaces_, colours_;  ///< The nearest key drawn into each pixel.
};

}  // namespace dtsdf
