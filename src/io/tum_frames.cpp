#include "dtsdf_mapping/io/tum_frames.h"

#include <cmath>
#include <stdexcept>
#include <vector>

#include "io/depth_png.h"
#include "io/tum_sequence.h"

namespace dtsdf {
namespace {

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
    const CameraInfo& camera = sequence_.camera;
    const auto pixels = std::make_shared<std::vector<uint16_t>>(
        readDepthPng(listed.path, camera.width, camera.height));
    SourceFrame frame;
    frame.stamp_s = listed.stamp_s;
    frame.pixels = pixels;
    frame.depth.data = pixels->data();
    frame.depth.row_bytes = static_cast<size_t>(camera.width) * sizeof(uint16_t);
    frame.depth.width = camera.width;
    frame.depth.height = camera.height;
    frame.depth.encoding = DepthEncoding::kUint16;
    frame.depth.unit_m = static_cast<float>(1.0 / options_.units_per_metre);
    frame.depth.intrinsics = camera.intrinsics;
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
