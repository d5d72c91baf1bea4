/// Interface of recorded colour: a sequence of colour images with poses, read next to a
/// FrameSource.
#pragma once

#include <cstddef>
#include <memory>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// A colour image with the memory it lies in.
struct SourceColour {
  ColourFrame colour;                  ///< Its `data` points into what `pixels` owns.
  std::shared_ptr<const void> pixels;  ///< Keeps the image alive, whatever library it came from.
  double stamp_s = 0.0;                ///< Stamp of the colour image.
  size_t index = 0;                    ///< Its index among the recording's colour images, by stamp.
};

/// The colour images of a recording in the order of their stamps.
using ColourSource = ImageSource<SourceColour>;

}  // namespace dtsdf
