#include "io/recorded_images.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "params/printable.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// The rows of an image, of so many values each, from the last to the first.
template <class Value>
void turnUpsideDown(std::vector<Value>& values, size_t row) {
  const auto length = static_cast<std::ptrdiff_t>(row);
  for (auto upper = values.begin(), lower = values.end(); lower - upper >= 2 * length;
       upper += length) {
    lower -= length;
    std::swap_ranges(upper, upper + length, lower);
  }
}

/// Of a camera whose images are turned upside down, as its y axis points up.
Intrinsics turnedUpsideDown(const Intrinsics& K, int height) {
  return {K.fx, -K.fy, K.cx, static_cast<float>(height - 1) - K.cy};
}

/// Counts an image that cannot be read. @throws std::runtime_error with the cures, if it must not
/// be.
void skipBad(bool skip_bad, const std::runtime_error& error, const std::string& kind,
             std::map<std::string, size_t>& skipped, std::map<std::string, std::string>& problems) {
  if (!skip_bad) {
    throw std::runtime_error(errorText(error) + "; --skip-bad skips such images" +
                             (kind.empty() ? "" : ", colour/enabled=never all in colour"));
  }
  const std::string reason = kind + "bad_image";
  ++skipped[reason];
  problems.emplace(reason, errorText(error));
}

class RecordedFrames : public FrameSource {
 public:
  RecordedFrames(RecordedImages images, const FrameSelection& selection)
      : images_(std::move(images)), selection_(selection) {
    const CameraInfo& camera = images_.camera;
    upside_down_ = camera.intrinsics.fy < 0.0f;
    frame_.row_bytes = static_cast<size_t>(camera.width) * sizeof(uint16_t);
    frame_.width = camera.width;
    frame_.height = camera.height;
    frame_.encoding = DepthEncoding::kUint16;
    frame_.unit_m = static_cast<float>(1.0 / images_.units_per_metre);
    frame_.intrinsics = camera.intrinsics;
    if (upside_down_) frame_.intrinsics = turnedUpsideDown(camera.intrinsics, camera.height);
  }

  std::optional<size_t> size() const override { return selection_.countIn(images_.depth.size()); }

  std::optional<size_t> posed() const override {
    size_t count = 0;
    for (size_t i = 0; i < images_.poses.size(); ++i) {
      count += selection_.contains(i) && images_.poses[i].T_W_C;
    }
    return count;
  }

  std::optional<SourceFrame> next() override {
    while (next_index_ < images_.depth.size()) {
      const size_t index = next_index_++;
      if (!selection_.contains(index)) continue;
      const ImagePose& pose = images_.poses[index];
      if (!pose.T_W_C) {
        ++skipped_[pose.missing];
        continue;
      }
      try {
        return makeFrame(index, *pose.T_W_C);
      } catch (const std::runtime_error& error) {
        skipBad(images_.skip_bad, error, "", skipped_, problems_);
      }
    }
    return std::nullopt;
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }
  std::map<std::string, std::string> problems() const override { return problems_; }

 private:
  SourceFrame makeFrame(size_t index, const Eigen::Isometry3d& T_W_C) const {
    const StampedImage& image = images_.depth[index];
    SourceFrame frame;
    frame.stamp_s = image.stamp_s;
    frame.index = index;
    frame.depth = frame_;
    frame.depth.T_W_C = T_W_C;
    if (images_.poses_only) return frame;
    const auto pixels = std::make_shared<std::vector<uint16_t>>(
        readDepthPng(image.path, {frame_.width, frame_.height}));
    if (upside_down_) turnUpsideDown(*pixels, static_cast<size_t>(frame_.width));
    frame.pixels = pixels;
    frame.depth.data = pixels->data();
    return frame;
  }

  RecordedImages images_;
  FrameSelection selection_;
  bool upside_down_ = false;
  DepthFrame frame_;  ///< What all frames share.
  size_t next_index_ = 0;
  std::map<std::string, size_t> skipped_;
  std::map<std::string, std::string> problems_;
};

bool hasPose(const ImagePose& pose) { return pose.T_W_C.has_value(); }

std::string describeRange(double first_s, double last_s) {
  return formatted("%.3f to %.3f s", first_s, last_s);
}

/// Why no image has a pose near its stamp.
std::string whyNoneNear(const Trajectory& trajectory, const std::vector<StampedImage>& images) {
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
                                                const FrameSelection& selection) {
  if (std::none_of(images.poses.begin(), images.poses.end(), hasPose)) {
    throw std::runtime_error("none of the " + std::to_string(images.poses.size()) +
                             " depth images has a pose (" + images.poses.front().missing +
                             "); give other poses by --poses FILE");
  }
  checkSelection(selection, images.depth.size());
  return std::make_unique<RecordedFrames>(std::move(images), selection);
}

std::vector<ImagePose> posesNear(const Trajectory& trajectory,
                                 const std::vector<StampedImage>& images, double tolerance_s) {
  std::vector<ImagePose> poses;
  poses.reserve(images.size());
  for (const StampedImage& image : images) {
    poses.push_back({trajectory.poseAt(image.stamp_s, tolerance_s), noPoseWithin(tolerance_s)});
  }
  if (!images.empty() && std::none_of(poses.begin(), poses.end(), hasPose)) {
    poses.front().missing += ": " + whyNoneNear(trajectory, images);
  }
  return poses;
}

namespace {

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
      if (problem.empty() && recorded_.poses_only) {
        SourceColour colour = makeColour(index);
        colour.index = next_++;
        return colour;
      }
      if (problem.empty()) {
        const std::shared_ptr<RgbImage> image = read(recorded_.images[index].path);
        if (image == nullptr) continue;
        problem = whyNotOfItsCamera(*image);
        if (problem.empty()) {
          SourceColour colour = makeColour(index);
          fill(colour, image);
          colour.index = next_++;
          return colour;
        }
      }
      ++skipped_["colour images: " + problem];
    }
    return std::nullopt;
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

  std::map<std::string, std::string> problems() const override { return problems_; }

 private:
  /// Null if it cannot be read, and may be skipped.
  std::shared_ptr<RgbImage> read(const std::string& path) {
    try {
      return std::make_shared<RgbImage>(readColourImage(path));
    } catch (const std::runtime_error& error) {
      skipBad(recorded_.skip_bad, error, "colour images: ", skipped_, problems_);
    }
    return nullptr;
  }

  bool isListed(size_t place) const {
    const auto& listed = recorded_.listed;
    if (!recorded_.selection.containsColour(place)) return false;
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
    return inWords(ImageSize{image.width, image.height}) + " pixels, but their camera has " +
           inWords(ImageSize{camera.width, camera.height});
  }

  SourceColour makeColour(size_t index) const {
    SourceColour result;
    result.stamp_s = recorded_.images[index].stamp_s;
    ColourFrame& colour = result.colour;
    colour.width = recorded_.camera->width;
    colour.height = recorded_.camera->height;
    colour.row_bytes = 3 * static_cast<size_t>(colour.width);
    colour.encoding = ColourEncoding::kRgb8;
    colour.T_W_C = *recorded_.poses[index].T_W_C;
    colour.intrinsics = recorded_.camera->intrinsics;
    if (isUpsideDown()) colour.intrinsics = turnedUpsideDown(colour.intrinsics, colour.height);
    return result;
  }

  void fill(SourceColour& colour, const std::shared_ptr<RgbImage>& image) const {
    if (isUpsideDown()) turnUpsideDown(image->rgb, colour.colour.row_bytes);
    colour.pixels = image;
    colour.colour.data = image->rgb.data();
  }

  bool isUpsideDown() const { return recorded_.camera->intrinsics.fy < 0.0f; }

  RecordedColours recorded_;
  std::vector<size_t> order_;  ///< Of the images, by stamp.
  size_t next_ = 0;            ///< In `order_`.
  std::map<std::string, size_t> skipped_;
  std::map<std::string, std::string> problems_;
};

}  // namespace

std::unique_ptr<ColourSource> openRecordedColours(RecordedColours recorded) {
  return std::make_unique<RecordedColourImages>(std::move(recorded));
}

}  // namespace dtsdf
