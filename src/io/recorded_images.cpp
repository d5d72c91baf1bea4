#include "io/recorded_images.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "io/depth_png.h"

namespace dtsdf {
namespace {

void turnUpsideDown(std::vector<uint16_t>& pixels, size_t width) {
  const size_t height = pixels.size() / width;
  for (size_t v = 0; v < height / 2; ++v) {
    std::swap_ranges(pixels.begin() + static_cast<std::ptrdiff_t>(v * width),
                     pixels.begin() + static_cast<std::ptrdiff_t>((v + 1) * width),
                     pixels.begin() + static_cast<std::ptrdiff_t>((height - 1 - v) * width));
  }
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
    if (upside_down_) {
      frame_.intrinsics.fy = -camera.intrinsics.fy;
      frame_.intrinsics.cy = static_cast<float>(camera.height - 1) - camera.intrinsics.cy;
    }
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
      if (pose.T_W_C) return makeFrame(index, *pose.T_W_C);
      ++skipped_[pose.missing];
    }
    return std::nullopt;
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

 private:
  SourceFrame makeFrame(size_t index, const Eigen::Isometry3d& T_W_C) const {
    const StampedImage& image = images_.depth[index];
    const auto pixels = std::make_shared<std::vector<uint16_t>>(
        readDepthPng(image.path, {frame_.width, frame_.height}));
    if (upside_down_) turnUpsideDown(*pixels, static_cast<size_t>(frame_.width));
    SourceFrame frame;
    frame.stamp_s = image.stamp_s;
    frame.index = index;
    frame.pixels = pixels;
    frame.depth = frame_;
    frame.depth.data = pixels->data();
    frame.depth.T_W_C = T_W_C;
    return frame;
  }

  RecordedImages images_;
  FrameSelection selection_;
  bool upside_down_ = false;
  DepthFrame frame_;  ///< What all frames share.
  size_t next_index_ = 0;
  std::map<std::string, size_t> skipped_;
};

bool hasPose(const ImagePose& pose) { return pose.T_W_C.has_value(); }

std::string describeRange(double first_s, double last_s) {
  std::ostringstream text;
  text.precision(3);
  text << std::fixed << first_s << " to " << last_s << " s";
  return text.str();
}

[[noreturn]] void throwNoMatch(const Trajectory& trajectory,
                               const std::vector<StampedImage>& images) {
  if (trajectory.poses().empty()) throw std::runtime_error("the list of poses is empty");
  const auto [first, last] = std::minmax_element(
      images.begin(), images.end(),
      [](const StampedImage& a, const StampedImage& b) { return a.stamp_s < b.stamp_s; });
  throw std::runtime_error(
      "no depth image has a pose near its stamp: image stamps are " +
      describeRange(first->stamp_s, last->stamp_s) + ", pose stamps " +
      describeRange(trajectory.poses().front().stamp_s, trajectory.poses().back().stamp_s) +
      "; use one clock for both, or raise --pose-tolerance if poses are sparse");
}

}  // namespace

std::unique_ptr<FrameSource> openRecordedImages(RecordedImages images,
                                                const FrameSelection& selection) {
  if (std::none_of(images.poses.begin(), images.poses.end(), hasPose)) {
    throw std::runtime_error("none of the " + std::to_string(images.poses.size()) +
                             " depth images has a pose (" + images.poses.front().missing +
                             "); give other poses by --poses FILE.tum");
  }
  checkSelection(selection, images.depth.size());
  return std::make_unique<RecordedFrames>(std::move(images), selection);
}

std::vector<ImagePose> posesNear(const Trajectory& trajectory,
                                 const std::vector<StampedImage>& images, double tolerance_s) {
  const std::string missing = noPoseWithin(tolerance_s);
  std::vector<ImagePose> poses;
  poses.reserve(images.size());
  for (const StampedImage& image : images) {
    poses.push_back({trajectory.poseAt(image.stamp_s, tolerance_s), missing});
  }
  return poses;
}

std::vector<ImagePose> posesByStamp(const Trajectory& trajectory,
                                    const std::vector<StampedImage>& images, double tolerance_s) {
  std::vector<ImagePose> poses = posesNear(trajectory, images, tolerance_s);
  if (std::none_of(poses.begin(), poses.end(), hasPose)) throwNoMatch(trajectory, images);
  return poses;
}

}  // namespace dtsdf
