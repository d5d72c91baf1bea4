/// The two kinds of a camera's images, depth and colour, which all else treats alike; and what
/// decodes compressed ones.
#pragma once

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <functional>
#include <optional>
#include <string>

#include "params/node_params.h"
#include "ros/input/frame.h"
#include "ros/input/images.h"
#include "ros/input/rectification.h"

namespace dtsdf {

// From messages of image_transport's compressed images to images, without its plugins.

/// What the transport appends to the name of an image's topic.
constexpr char kCompressedDepthTopic[] = "/compressedDepth";
constexpr char kCompressedTopic[] = "/compressed";

/// Whether a message holds depth, by what its format says.
bool holdsDepth(const sensor_msgs::CompressedImage& message);

/// @throws std::runtime_error that says what is wrong with the message.
sensor_msgs::ImageConstPtr decodeDepth(const sensor_msgs::CompressedImage& message);

/// Whether a message holds the image of a colour camera, JPEG or PNG.
bool holdsColour(const sensor_msgs::CompressedImage& message);

/// As rgb8. @throws std::runtime_error that says what is wrong with the message.
sensor_msgs::ImageConstPtr decodeColour(const sensor_msgs::CompressedImage& message);

struct ImageKind {
  // What they come by.
  std::string image_topic, info_topic;  ///< "depth/image_rect" and "depth/camera_info".
  std::string transport_param;  ///< The private parameter that has the transport of the images.
  std::string own_transport;    ///< The one whose images are decoded here if there is no plugin.
  sensor_msgs::ImageConstPtr (*decode)(const sensor_msgs::CompressedImage&);  ///< By this.
  double max_rate_hz;  ///< Of what is taken of them; 0: all.

  // What becomes of them.
  Rectification::Kind rectified_as;
  /// What is wrong with an image; nothing if it is usable.
  std::optional<Rejection> (*check)(const sensor_msgs::Image&, const sensor_msgs::CameraInfo&);
  /// Fills in the image of a frame, but for its pose, and its pixels.
  /// @throws what OpenCV and cv_bridge throw for what the check should have refused.
  std::function<void(const CameraImage& camera, PosedFrame& frame)> fill;
};

ImageKind makeDepthKind(const InputParams& params);
ImageKind makeColourKind(const ColourParams& params);

}  // namespace dtsdf
