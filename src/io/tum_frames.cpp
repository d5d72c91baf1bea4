#include "dtsdf_mapping/io/tum_frames.h"

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "dtsdf_mapping/io/tum_sequence.h"

namespace dtsdf {
namespace {

/// A decoded depth image of the expected type and size.
std::shared_ptr<cv::Mat> readDepthImage(const std::string& path, const CameraInfo& camera) {
  if (!std::filesystem::is_regular_file(path)) {
    throw std::runtime_error("cannot read '" + path +
                             "': there is no such file; depth.txt names it");
  }
  auto image = std::make_shared<cv::Mat>();
  try {
    *image = cv::imread(path, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    throw std::runtime_error("cannot decode '" + path + "': " + e.err);
  }
  if (image->empty()) {
    throw std::runtime_error("cannot decode '" + path + "': not an image, or damaged");
  }
  if (image->type() != CV_16UC1) {
    throw std::runtime_error("'" + path + "' is not a 16-bit grey image, so it holds no depth");
  }
  if (image->cols != camera.width || image->rows != camera.height) {
    throw std::runtime_error("'" + path + "' is " + std::to_string(image->cols) + " x " +
                             std::to_string(image->rows) + " pixels, but camera_info.yaml says " +
                             std::to_string(camera.width) + " x " + std::to_string(camera.height));
  }
  return image;
}

class TumFrames : public FrameSource {
 public:
  explicit TumFrames(const TumOptions& options)
      : options_(options), sequence_(readTumSequence(options.folder)) {
    const double tolerance_ms = 1000.0 * options_.pose_tolerance_s;
    no_pose_reason_ = "no pose within " + std::to_string(std::lround(tolerance_ms)) + " ms";
  }

  std::optional<size_t> size() const override {
    return options_.selection.countIn(sequence_.depth.size());
  }

  std::optional<SourceFrame> next() override {
    while (next_index_ < sequence_.depth.size()) {
      const size_t index = next_index_++;
      if (!options_.selection.contains(index)) continue;
      const StampedImage& listed = sequence_.depth[index];
      const auto T_W_C = sequence_.trajectory.poseAt(listed.stamp_s, options_.pose_tolerance_s);
      if (T_W_C) return makeFrame(listed, *T_W_C);
      ++skipped_[no_pose_reason_];
    }
    return std::nullopt;
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

 private:
  SourceFrame makeFrame(const StampedImage& listed, const Eigen::Isometry3d& T_W_C) const {
    const std::shared_ptr<cv::Mat> image = readDepthImage(listed.path, sequence_.camera);
    SourceFrame frame;
    frame.stamp_s = listed.stamp_s;
    frame.pixels = image;
    frame.depth.data = image->data;
    frame.depth.row_bytes = image->step[0];
    frame.depth.width = image->cols;
    frame.depth.height = image->rows;
    frame.depth.encoding = DepthEncoding::kUint16;
    frame.depth.unit_m = static_cast<float>(1.0 / options_.units_per_metre);
    frame.depth.intrinsics = sequence_.camera.intrinsics;
    frame.depth.T_W_C = T_W_C;
    return frame;
  }

  TumOptions options_;
  TumSequence sequence_;
  std::string no_pose_reason_;
  size_t next_index_ = 0;
  std::map<std::string, size_t> skipped_;
};

}  // namespace

std::unique_ptr<FrameSource> openTumFrames(const TumOptions& options) {
  if (!(options.units_per_metre > 0.0) || !std::isfinite(options.units_per_metre)) {
    throw std::runtime_error("the depth scale must be above 0 units per metre");
  }
  return std::make_unique<TumFrames>(options);
}

}  // namespace dtsdf
