/// The images of a view from its pixels' keys, for both backends.
#pragma once

#include "dtsdf_mapping/rendered_view.h"
#include "kernels/core/camera.h"
#include "kernels/render/view_key.h"

namespace dtsdf {

/// Makes room for a view's images, with or without colours.
void resizeView(const FrameView& frame, bool has_colours, RenderedView& view);

/// Fills rows of them. `colours` is null without colours.
void fillRows(const FrameView& frame, int32_t begin, int32_t end, const ViewKey* surfaces,
              const ViewKey* colours, RenderedView& view);

}  // namespace dtsdf
