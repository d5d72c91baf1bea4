/// Interface of recorded colour: a sequence of colour images with poses, beside a FrameSource.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "dtsdf_mapping/colour_frame.h"

namespace dtsdf {

/// A colour image with the memory it lies in.
struct SourceColour {
  ColourFrame colour;                  ///< Its `data` points into what `pixels` owns.
  std::shared_ptr<const void> pixels;  ///< Keeps the image alive, whatever library it came from.
  double stamp_s = 0.0;                ///< Stamp of the colour image.
  size_t index = 0;                    ///< Its place among all of the recording, by stamps.
};

/// Hands out the colour images of a recording in the order of their stamps. One thread at a time.
class ColourSource {
 public:
  virtual ~ColourSource() = default;

  /// The next image that has a pose, or nothing at the end; others are skipped and counted.
  /// @throws std::runtime_error if the recording is broken: file, place and what to do.
  virtual std::optional<SourceColour> next() = 0;

  /// Images skipped so far, by reason.
  virtual const std::map<std::string, size_t>& skipped() const = 0;

  /// What is known of the first image skipped for a reason, in a sentence.
  virtual std::map<std::string, std::string> problems() const { return {}; }
};

}  // namespace dtsdf
