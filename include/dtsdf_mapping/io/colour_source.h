/// Interface to recorded colour images: a sequence of images with poses.
#pragma once

#include <cstddef>
#include <memory>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// A colour image that owns its memory.
struct SourceColour {
  ColourFrame colour;                  ///< Image whose `data` points to memory owned by `pixels`.
  std::shared_ptr<const void> pixels;  ///< Keeps the image's memory alive.
  double stamp_s = 0.0;                ///< Stamp of the colour image.
  size_t index = 0;  ///< Index among the colour images of the recording, ordered by stamp.
};

/// The colour images of a recording, ordered by stamp.
using ColourSource = ImageSource<SourceColour>;

}  // namespace dtsdf
