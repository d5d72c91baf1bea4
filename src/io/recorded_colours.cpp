#include "io/recorded_colours.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "io/colour_codes.h"

namespace dtsdf {
namespace {

std::string sizeInWords(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

void turnImageUpsideDown(RgbImage& image) {
  const auto row = static_cast<std::ptrdiff_t>(3 * static_cast<size_t>(image.width));
  for (int v = 0; v < image.height / 2; ++v) {
    const auto upper = image.rgb.begin() + v * row;
    std::swap_ranges(upper, upper + row, image.rgb.end() - (v + 1) * row);
  }
}

RgbImage readOrAdvise(const std::string& path) {
  try {
    return readColourImage(path);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string(error.what()) +
                             "; colour/enabled=never ignores colour images");
  }
}

class RecordedColourImages : public ColourSource {
 public:
  explicit RecordedColourImages(RecordedColours recorded)
      : recorded_(std::move(recorded)), order_(recorded_.images.size()) {
    std::iota(order_.begin(), order_.end(), size_t{0});
    std::stable_sort(order_.begin(), order_.end(), [this](size_t a, size_t b) {
      return recorded_.images[a].stamp_s < recorded_.images[b].stamp_s;
    });
  }

  std::optional<SourceColour> next() override {
    for (; next_ < order_.size(); ++next_) {
      if (!isListed(next_)) continue;
      const size_t index = order_[next_];
      std::string problem = whyNotPosed(index);
      if (problem.empty()) {
        const auto image = std::make_shared<RgbImage>(readOrAdvise(recorded_.images[index].path));
        problem = whyNotOfItsCamera(*image);
        if (problem.empty()) {
          SourceColour colour = makeColour(index, image);
          colour.index = next_++;
          return colour;
        }
      }
      ++skipped_["colour images: " + problem];
    }
    return std::nullopt;
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

 private:
  bool isListed(size_t place) const {
    const auto& listed = recorded_.listed;
    return listed == nullptr || std::binary_search(listed->begin(), listed->end(), place);
  }

  /// Found out before the image is decoded.
  std::string whyNotPosed(size_t index) const {
    if (!recorded_.camera) return recorded_.missing_camera;
    if (!recorded_.poses[index].T_W_C) return recorded_.poses[index].missing;
    return std::filesystem::exists(recorded_.images[index].path) ? "" : "no such file";
  }

  std::string whyNotOfItsCamera(const RgbImage& image) const {
    const CameraInfo& camera = *recorded_.camera;
    if (image.width == camera.width && image.height == camera.height) return "";
    return sizeInWords(image.width, image.height) + " pixels, but their camera has " +
           sizeInWords(camera.width, camera.height);
  }

  SourceColour makeColour(size_t index, const std::shared_ptr<RgbImage>& image) const {
    SourceColour result;
    result.stamp_s = recorded_.images[index].stamp_s;
    result.pixels = image;
    ColourFrame& colour = result.colour;
    colour.intrinsics = recorded_.camera->intrinsics;
    if (colour.intrinsics.fy < 0.0f) {
      turnImageUpsideDown(*image);
      colour.intrinsics.fy = -colour.intrinsics.fy;
      colour.intrinsics.cy = static_cast<float>(image->height - 1) - colour.intrinsics.cy;
    }
    colour.data = image->rgb.data();
    colour.row_bytes = 3 * static_cast<size_t>(image->width);
    colour.width = image->width;
    colour.height = image->height;
    colour.encoding = ColourEncoding::kRgb8;
    colour.T_W_C = *recorded_.poses[index].T_W_C;
    return result;
  }

  RecordedColours recorded_;
  std::vector<size_t> order_;  ///< Of the images, by stamp.
  size_t next_ = 0;            ///< In `order_`.
  std::map<std::string, size_t> skipped_;
};

}  // namespace

std::unique_ptr<ColourSource> openRecordedColours(RecordedColours recorded) {
  return std::make_unique<RecordedColourImages>(std::move(recorded));
}

}  // namespace dtsdf
