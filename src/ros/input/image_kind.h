/// The two kinds of images that become frames, for the intake, which treats them alike.
#pragma once

#include <functional>
#include <optional>

#include "params/node_params.h"
#include "ros/input/image_checks.h"
#include "ros/input/posed_frame.h"
#include "ros/input/rectification.h"

namespace dtsdf {

struct ImageKind {
  Rectification::Kind rectified_as;

  /// What is wrong with an image; nothing if it is usable.
  std::function<std::optional<Rejection>(const sensor_msgs::Image&, const sensor_msgs::CameraInfo&)>
      check;

  /// Fills in the image of a frame, but for its pose, and its pixels.
  /// @throws what OpenCV and cv_bridge throw for what the check should have refused.
  std::function<void(const CameraImage& camera, PosedFrame& frame)> fill;
};

ImageKind makeDepthKind(const InputParams& params);
ImageKind makeColourKind();

}  // namespace dtsdf
