/// The stage "render" on the device: views of the map from any pose.
#pragma once

#include <vector>

#include "backend/map_backend.h"
#include "device_map.h"
#include "dtsdf_mapping/rendered_view.h"
#include "kernels/render/between_rays.h"
#include "runtime/buffer.h"
#include "view_units.h"

namespace dtsdf {
namespace gpu {

/// What kernels need of a view, by value.
struct RenderJob {
  ViewScene scene;
  ViewUnits units;
  int32_t painted;  ///< Colours are asked for.
  int32_t tile_columns;
  TileRange* ranges;  ///< By tile.
  RenderedPixel* pixels;
};

/// The buffers are kept from view to view.
class Renderer {
 public:
  Renderer(const MeshRules& rules, bool directional, const Stream& stream);

  /// Renders surfaces; waits for the images.
  void render(const ViewRequest& request, const MapView& map, RenderedView& view);

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  void reserve(const FrameView& frame);
  void cast(RenderJob job, const MapView& map);
  void handOut(const RenderJob& job, RenderedView& view);

  const MeshRules rules_;
  const bool directional_;
  const Stream& stream_;
  UnitMaker units_;
  DeviceBuffer<MeshTables> tables_;
  DeviceBuffer<TileRange> ranges_;
  DeviceBuffer<RenderedPixel> pixels_;
  DeviceBuffer<float> depth_m_;
  DeviceBuffer<Vec3f> normals_C_;
  DeviceBuffer<VertexColour> colours_;
  PinnedBuffer<float> pinned_depth_m_;
  PinnedBuffer<Vec3f> pinned_normals_C_;
  PinnedBuffer<VertexColour> pinned_colours_;
};

}  // namespace gpu
}  // namespace dtsdf
