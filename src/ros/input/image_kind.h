/// The two kinds of images that become frames, for the intake, which treats them alike.
#pragma once

#include <memory>
#include <optional>

#include "params/node_params.h"
#include "ros/input/image_checks.h"
#include "ros/input/posed_frame.h"
#include "ros/input/rectification.h"

namespace dtsdf {

class ImageKind {
 public:
  virtual ~ImageKind() = default;

  virtual Rectification::Kind rectifiedAs() const = 0;

  /// What is wrong with an image; nothing if it is usable.
  virtual std::optional<Rejection> check(const sensor_msgs::Image& image,
                                         const sensor_msgs::CameraInfo& info) const = 0;

  /// Fills in the image of a frame, but for its pose, and its pixels.
  /// @throws what OpenCV and cv_bridge throw for what the check should have refused.
  virtual void fill(const CameraImage& camera, PosedFrame& frame) const = 0;
};

std::unique_ptr<ImageKind> makeDepthKind(const InputParams& params);
std::unique_ptr<ImageKind> makeColourKind();

}  // namespace dtsdf
