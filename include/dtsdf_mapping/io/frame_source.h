/// Interface to recorded input: a sequence of depth images with poses, from a folder or a bag.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// A depth image that owns its memory.
struct SourceFrame {
  DepthFrame depth;                    ///< Image whose `data` points to memory owned by `pixels`.
  std::shared_ptr<const void> pixels;  ///< Keeps the image's memory alive.
  double stamp_s = 0.0;                ///< Stamp of the depth image.
  size_t index = 0;                    ///< Index in the recording, starting at 0.
};

/// Selects depth images of a recording by index: first, first + step, ... up to and including last.
/// Images without a pose are counted too, so an index always refers to the same image.
struct FrameSelection {
  size_t first = 0;                                  ///< Index of the first selected image.
  size_t last = std::numeric_limits<size_t>::max();  ///< Largest selected index.
  size_t step = 1;                                   ///< At least 1.
  /// If not null, restricts the selection further to these indices, in ascending order.
  std::shared_ptr<const std::vector<size_t>> listed;

  /// Whether the image with this index is selected.
  bool contains(size_t index) const {
    return index >= first && index <= last && (index - first) % step == 0 &&
           (listed == nullptr || std::binary_search(listed->begin(), listed->end(), index));
  }
  /// Whether the colour image with this index is selected. Selects one in every `step` images.
  bool containsColour(size_t index) const { return index % step == first % step; }
  /// Number of selected images in a recording of `total` images.
  size_t countIn(size_t total) const {
    if (listed != nullptr) {
      return static_cast<size_t>(std::count_if(listed->begin(), listed->end(), [&](size_t index) {
        return index < total && contains(index);
      }));
    }
    if (total == 0 || first > last || first >= total) return 0;
    return ((last < total ? last : total - 1) - first) / step + 1;
  }
};

/// Delivers the images of a recording in order, without loss. Not thread safe.
template <class Image>
class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// Number of selected images, including those that will be skipped; empty if unknown in advance.
  virtual std::optional<size_t> size() const { return std::nullopt; }

  /// Number of selected images that have a pose; empty if unknown in advance.
  virtual std::optional<size_t> posed() const { return std::nullopt; }

  /// The next usable image, or nothing at the end. Unusable images (no pose, wrong encoding) are
  /// skipped and counted.
  /// @throws std::runtime_error if the recording is damaged; the message names the file and says
  /// what to do.
  virtual std::optional<Image> next() = 0;

  /// Images skipped so far, by reason ("no pose within 20 ms").
  virtual const std::map<std::string, size_t>& skipped() const { return skipped_; }

  /// Explanations for some of the reasons in skipped(), each a sentence about the first image
  /// skipped for that reason.
  virtual std::map<std::string, std::string> problems() const { return problems_; }

 protected:
  std::map<std::string, size_t> skipped_;        ///< See skipped().
  std::map<std::string, std::string> problems_;  ///< See problems().
};

/// The selected depth images of a recording.
using FrameSource = ImageSource<SourceFrame>;

}  // namespace dtsdf
