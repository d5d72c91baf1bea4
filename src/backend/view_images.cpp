#include "backend/view_images.h"

namespace dtsdf {

void resizeView(const FrameView& frame, bool has_colours, RenderedView& view) {
  const size_t pixels = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  view.width = frame.width;
  view.height = frame.height;
  view.depth_m.resize(pixels);
  view.normals_C.resize(pixels);
  view.colours.resize(has_colours ? pixels : 0);
}

void fillRows(const FrameView& frame, int32_t begin, int32_t end, const ViewKey* surfaces,
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

}  // namespace dtsdf
