#include "dtsdf_mapping/io/tum_colours.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "io/colour_image_file.h"
#include "io/tum_sequence.h"

namespace dtsdf {
namespace {

class TumColours : public ColourSource {
 public:
  TumColours(TumSequence sequence, const CameraInfo& camera, double pose_tolerance_s)
      : sequence_(std::move(sequence)), camera_(camera), pose_tolerance_s_(pose_tolerance_s) {
    const long tolerance_ms = std::lround(1000.0 * pose_tolerance_s);
    no_pose_reason_ = "colour images without a pose within " + std::to_string(tolerance_ms) + " ms";
    std::stable_sort(
        sequence_.colour.begin(), sequence_.colour.end(),
        [](const StampedImage& a, const StampedImage& b) { return a.stamp_s < b.stamp_s; });
  }

  std::optional<SourceColour> next() override {
    while (next_index_ < sequence_.colour.size()) {
      const StampedImage& listed = sequence_.colour[next_index_++];
      const auto T_W_C = sequence_.trajectory.poseAt(listed.stamp_s, pose_tolerance_s_);
      if (T_W_C) return makeColour(listed, *T_W_C);
      ++skipped_[no_pose_reason_];
    }
    return std::nullopt;
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

 private:
  SourceColour makeColour(const StampedImage& listed, const Eigen::Isometry3d& T_W_C) const {
    const auto image = std::make_shared<const ColourImageFile>(readColourImage(listed.path));
    if (image->width != camera_.width || image->height != camera_.height) {
      throw std::runtime_error(
          "'" + listed.path + "' is " + std::to_string(image->width) + " x " +
          std::to_string(image->height) + " pixels, but the camera has " +
          std::to_string(camera_.width) + " x " + std::to_string(camera_.height) +
          "; put the colour camera's calibration beside rgb.txt, as colour_info.yaml");
    }
    SourceColour result;
    result.stamp_s = listed.stamp_s;
    result.pixels = image;
    result.colour.data = image->rgb.data();
    result.colour.row_bytes = 3 * static_cast<size_t>(image->width);
    result.colour.width = image->width;
    result.colour.height = image->height;
    result.colour.encoding = ColourEncoding::kRgb8;
    result.colour.intrinsics = camera_.intrinsics;
    result.colour.T_W_C = T_W_C;
    return result;
  }

  TumSequence sequence_;
  CameraInfo camera_;
  double pose_tolerance_s_;
  std::string no_pose_reason_;
  size_t next_index_ = 0;
  std::map<std::string, size_t> skipped_;
};

}  // namespace

std::unique_ptr<ColourSource> openTumColours(const std::string& folder, double pose_tolerance_s) {
  TumSequence sequence = readTumSequence(folder);
  if (sequence.colour.empty()) return nullptr;
  const std::filesystem::path own_camera = std::filesystem::path(folder) / "colour_info.yaml";
  const CameraInfo camera = std::filesystem::exists(own_camera)
                                ? loadCameraInfo(own_camera.string())
                                : sequence.camera;
  return std::make_unique<TumColours>(std::move(sequence), camera, pose_tolerance_s);
}

}  // namespace dtsdf
