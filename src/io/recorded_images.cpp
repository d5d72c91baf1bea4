#include "io/recorded_images.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "params/printable.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// Flips an image vertically. @param row Number of values per row.
template <class Value>
void flipRows(std::vector<Value>& values, size_t row) {
  const auto length = static_cast<std::ptrdiff_t>(row);
  for (auto upper = values.begin(), lower = values.end(); lower - upper >= 2 * length;
       upper += length) {
    lower -= length;
    std::swap_ranges(upper, upper + length, lower);
  }
}

/// Intrinsics after an image is flipped because the camera's y axis points up.
Intrinsics flippedIntrinsics(const Intrinsics& K, int height) {
  return {K.fx, -K.fy, K.cx, static_cast<float>(height - 1) - K.cy};
}

template <class Image>
class RecordedSource : public ImageSource<Image> {
 public:
  RecordedSource(RecordedImages recorded, const RecordingOptions& options)
      : recorded_(std::move(recorded)), options_(options) {}

  std::optional<size_t> size() const override {
    if (kIsColour) return std::nullopt;
    return options_.selection.countIn(recorded_.images.size());
  }

  std::optional<size_t> posed() const override {
    if (kIsColour) return std::nullopt;
    size_t count = 0;
    for (size_t i = 0; i < recorded_.images.size(); ++i)
      count += isSelected(options_, kIsColour, i) && recorded_.images[i].T_W_C.has_value();
    return count;
  }

  std::optional<Image> next() override {
    while (next_ < recorded_.images.size()) {
      const size_t index = next_++;
      if (!isSelected(options_, kIsColour, index)) continue;
      std::string problem = skipReason(index);
      try {
        if (problem.empty()) {
          Image image = withoutPixels(index);
          image.stamp_s = recorded_.images[index].stamp_s;
          image.index = index;
          if (!options_.poses_only) problem = read(recorded_.images[index].path, image);
          if (problem.empty()) return image;
        }
        ++this->skipped_[kind_ + problem];
      } catch (const std::runtime_error& error) {
        skip(error);
      }
    }
    return std::nullopt;
  }

 private:
  static constexpr bool kIsColour = std::is_same_v<Image, SourceColour>;
  /// Prefix of the reasons in skipped().
  const std::string kind_ = kIsColour ? "colour images: " : "";

  /// The reason for skipping an image without decoding it; empty if it is to be decoded.
  std::string skipReason(size_t index) const {
    if (!recorded_.camera) return recorded_.missing_camera;
    if (!recorded_.images[index].T_W_C) return recorded_.images[index].missing;
    const bool may_lack = kIsColour && !std::filesystem::exists(recorded_.images[index].path);
    return may_lack ? "no such file" : "";
  }

  bool isFlipped() const { return recorded_.camera->intrinsics.fy < 0.0f; }

  template <class Frame>
  void placeCamera(size_t index, size_t pixel_bytes, Frame& frame) const {
    frame.width = recorded_.camera->width;
    frame.height = recorded_.camera->height;
    frame.row_bytes = static_cast<size_t>(frame.width) * pixel_bytes;
    frame.intrinsics = recorded_.camera->intrinsics;
    if (isFlipped()) frame.intrinsics = flippedIntrinsics(frame.intrinsics, frame.height);
    frame.T_W_C = *recorded_.images[index].T_W_C;
  }

  Image withoutPixels(size_t index) const {
    Image image;
    if constexpr (kIsColour) {
      placeCamera(index, 3, image.colour);
      image.colour.encoding = ColourEncoding::kRgb8;
    } else {
      placeCamera(index, sizeof(uint16_t), image.depth);
      image.depth.encoding = DepthEncoding::kUint16;
      image.depth.unit_m = static_cast<float>(1.0 / recorded_.units_per_metre);
    }
    return image;
  }

  /// @return an error message, or an empty string.
  std::string read(const std::string& path, SourceFrame& frame) const {
    const auto pixels = std::make_shared<std::vector<uint16_t>>(
        readDepthPng(path, frame.depth.width, frame.depth.height));
    if (isFlipped()) flipRows(*pixels, static_cast<size_t>(frame.depth.width));
    frame.pixels = pixels;
    frame.depth.data = pixels->data();
    return "";
  }

  std::string read(const std::string& path, SourceColour& image) const {
    const auto read = std::make_shared<RgbImage>(readColourImage(path));
    ColourFrame& colour = image.colour;
    if (read->width != colour.width || read->height != colour.height) {
      return formatted("%d x %d pixels, but their camera has %d x %d", read->width, read->height,
                       colour.width, colour.height);
    }
    if (isFlipped()) flipRows(read->values, colour.row_bytes);
    image.pixels = read;
    colour.data = read->values.data();
    return "";
  }

  /// Skips a bad image if skip_bad is set. @throws std::runtime_error with advice if it is not set.
  void skip(const std::runtime_error& error) {
    if (!options_.skip_bad) {
      throw std::runtime_error(errorText(error) + "; --skip-bad skips such images" +
                               (kIsColour ? ", colour/enabled=never skips all colour images" : ""));
    }
    ++this->skipped_[kind_ + "bad_image"];
    this->problems_.emplace(kind_ + "bad_image", errorText(error));
  }

  const RecordedImages recorded_;
  const RecordingOptions options_;
  size_t next_ = 0;
};

bool hasPose(const StampedImage& image) { return image.T_W_C.has_value(); }

std::string describeRange(double first_s, double last_s) {
  return formatted("%.3f to %.3f s", first_s, last_s);
}

/// Why no image has a pose near its stamp.
std::string describeStampMismatch(const Trajectory& trajectory,
                                  const std::vector<StampedImage>& images) {
  if (trajectory.poses().empty()) return "the list of poses is empty";
  const auto [first, last] = std::minmax_element(
      images.begin(), images.end(),
      [](const StampedImage& a, const StampedImage& b) { return a.stamp_s < b.stamp_s; });
  return "image stamps are " + describeRange(first->stamp_s, last->stamp_s) + ", pose stamps " +
         describeRange(trajectory.poses().front().stamp_s, trajectory.poses().back().stamp_s) +
         "; use one clock for both, or raise --pose-tolerance if poses are sparse";
}

}  // namespace

std::unique_ptr<FrameSource> openRecordedImages(RecordedImages images,
                                                const RecordingOptions& options) {
  if (std::none_of(images.images.begin(), images.images.end(), hasPose)) {
    throw std::runtime_error("none of the " + std::to_string(images.images.size()) +
                             " depth images has a pose (" + images.images.front().missing +
                             "); give other poses with --poses FILE");
  }
  checkSelection(options.selection, images.images.size());
  return std::make_unique<RecordedSource<SourceFrame>>(std::move(images), options);
}

std::unique_ptr<ColourSource> openRecordedColours(RecordedImages images,
                                                  const RecordingOptions& options) {
  return std::make_unique<RecordedSource<SourceColour>>(std::move(images), options);
}

void findPosesNear(const Trajectory& trajectory, double tolerance_s,
                   std::vector<StampedImage>& images) {
  for (StampedImage& image : images) {
    image.T_W_C = trajectory.poseAt(image.stamp_s, tolerance_s);
    image.missing = noPoseWithin(tolerance_s);
  }
  if (!images.empty() && std::none_of(images.begin(), images.end(), hasPose)) {
    images.front().missing += ": " + describeStampMismatch(trajectory, images);
  }
}

}  // namespace dtsdf
