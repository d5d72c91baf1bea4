/// The stage "render" on the device: renders views of the map from any pose.
#pragma once

#include <vector>

#include "backend/map_backend.h"
#include "dtsdf_mapping/rendered_view.h"
#include "kernels/render/drawn_triangle.h"
#include "mesh_kernels.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// What kernels need to know about a view, passed by value.
struct RenderJob {
  FrameView frame;
  int32_t painted;  ///< Whether colours are requested.
  Vec3i* shares;    ///< Sum of the triangles' normals at each vertex.
  ProjectedVertex* seen;
  ViewKey* surfaces;  ///< Per pixel.
  ViewKey* colours;   ///< Per pixel, if colours are requested.
};

/// Finds the marching cubes cases (labels) of the blocks in view, extracts and draws triangles.
class Renderer {
 public:
  Renderer(const MeshSettings& rules, bool directional, const Stream& stream);

  /// Renders surfaces, and waits for the images. Updates the labels of blocks first, unless
  /// `is_labelled`. @pre No extraction is reading labels.
  void render(const ViewRequest& request, const MapView& map, bool is_labelled, RenderedView& view);

  void addMemory(MapperMemory& memory) const;

 private:
  MeshView meshView(const ViewRequest& request);
  void reserveMeshes(const MeshSize& size);
  void draw(const ViewRequest& request, const MapView& map, bool is_labelled);
  void drawBlocks(const ViewRequest& request, const RenderJob& job, const MapView& map,
                  bool is_labelled);
  void fill(const ViewRequest& request, RenderedView& view) const;

  const MeshSettings rules_;
  const bool directional_;
  const int thread_blocks_;
  const Stream& stream_;
  DeviceBuffer<MeshTotals> totals_, labelled_;  ///< labelled_ is used only to count blocks.
  PinnedBuffer<MeshTotals> pinned_totals_;
  static constexpr size_t kBands = 8;  ///< Number of bands of pixels, downloaded in sequence.
  Event drawn_[kBands];                ///< Recorded after a band's download.
  DeviceBuffer<uint32_t> no_dirty_;    ///< Always 0: views use it as their count of dirty blocks.
  DeviceBuffer<int32_t> slots_, labelled_slots_;
  DeviceBuffer<MeshRecord> records_;
  DeviceBuffer<BlockVertex> vertices_;
  DeviceBuffer<VertexColour> vertex_colours_;
  DeviceBuffer<Vec3i> shares_;
  DeviceBuffer<ProjectedVertex> seen_;
  DeviceBuffer<BlockTriangle> triangles_;
  DeviceBuffer<ViewKey> surfaces_, colours_;
  DeviceBuffer<float> depth_;
  DeviceBuffer<Vec3f> normals_;
  DeviceBuffer<VertexColour> view_colours_;
  PinnedBuffer<float> pinned_depth_;
  PinnedBuffer<Vec3f> pinned_normals_;
  PinnedBuffer<VertexColour> pinned_colours_;
};

}  // namespace gpu
}  // namespace dtsdf
