/// An image on its way to the map: what belongs to it as it was received, and what is fused of it.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <string>
#include <variant>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "ros/input/frame_accounting.h"

namespace dtsdf {

/// Stamps that jump back by more than this mean a new recording or a loop of it; less is disorder.
constexpr double kTimeJump_s = 0.5;

/// Messages of one stamp.
struct FrameMessages {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;
  sensor_msgs::ImageConstPtr mask;  ///< Only where masks are wanted.
};

/// A frame with what its pixels live in.
struct PosedFrame {
  ros::Time stamp;
  std::variant<DepthFrame, ColourFrame> image;
  cv_bridge::CvImageConstPtr pixels;
  std::string frame_id;                   ///< Of its camera.
  size_t camera = 0;                      ///< Its place among the cameras.
  FrameAccounting* accounting = nullptr;  ///< Of its stream.
};

/// What the pixels of a frame take.
inline size_t bytesOf(const PosedFrame& frame) {
  return std::visit(
      [](const auto& image) { return image.row_bytes * static_cast<size_t>(image.height); },
      frame.image);
}

}  // namespace dtsdf
