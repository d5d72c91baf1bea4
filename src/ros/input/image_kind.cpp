#include "ros/input/image_kind.h"

#include "ros/input/colour_image.h"
#include "ros/input/depth_image.h"

namespace dtsdf {
namespace {

class DepthKind : public ImageKind {
 public:
  explicit DepthKind(const DepthUnits& units) : units_(units) {}

  Rectification::Kind rectifiedAs() const override { return Rectification::Kind::kDepth; }

  std::optional<Rejection> check(const sensor_msgs::Image& image,
                                 const sensor_msgs::CameraInfo& info) const override {
    return checkDepthImage(image, info);
  }

  void fill(const CameraImage& camera, PosedFrame& frame) const override {
    frame.image = makeDepthFrame(camera.image, *camera.info, units_, frame.pixels);
  }

 private:
  DepthUnits units_;
};

class ColourKind : public ImageKind {
 public:
  Rectification::Kind rectifiedAs() const override { return Rectification::Kind::kColour; }

  std::optional<Rejection> check(const sensor_msgs::Image& image,
                                 const sensor_msgs::CameraInfo& info) const override {
    return checkColourImage(image, info);
  }

  void fill(const CameraImage& camera, PosedFrame& frame) const override {
    frame.image = makeColourFrame(camera.image, *camera.info, frame.pixels);
  }
};

}  // namespace

std::unique_ptr<ImageKind> makeDepthKind(const InputParams& params) {
  return std::make_unique<DepthKind>(DepthUnits{params.unit_16uc1_m, params.unit_32fc1_m});
}

std::unique_ptr<ImageKind> makeColourKind() { return std::make_unique<ColourKind>(); }

}  // namespace dtsdf
