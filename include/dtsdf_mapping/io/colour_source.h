/// Interface to recorded colour images: a sequence of images with poses.
#pragma once

#include <cstddef>
#include <memory>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// A colour image that owns its memory.
struct SourceColour {
  ColourFrame colour;                  ///< Its `data` points to memory that `pixels` owns.
  std::shared_ptr<const void> pixels;  ///< Keeps the image's memory alive.
  double stamp_s = 0.0;                ///< Stamp of the colour image.
  size_t index = 0;  ///< Index among the recording's colour images, in the order of their stamps.
};

/// The colour images of a recording in the order of their stamps.
using ColourSource = ImageSource<SourceColour>;

}  // namespace dtsdf
