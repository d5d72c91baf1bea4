/// The two kinds of a camera's images, depth and colour, and what decodes compressed ones.
#pragma once

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <optional>
#include <string>

#include "ros/input/images.h"

namespace dtsdf {

/// What image_transport appends to the name of an image's topic for its compressed images.
constexpr char kCompressedDepthTopic[] = "/compressedDepth";
constexpr char kCompressedTopic[] = "/compressed";

/// Whether a message holds depth, by what its format says.
bool holdsDepth(const sensor_msgs::CompressedImage& message);

/// Without image_transport's plugins. @throws std::runtime_error that says what is wrong.
sensor_msgs::ImageConstPtr decodeDepth(const sensor_msgs::CompressedImage& message);

/// Whether a message holds the image of a colour camera, JPEG or PNG.
bool holdsColour(const sensor_msgs::CompressedImage& message);

/// As rgb8. @throws std::runtime_error that says what is wrong with the message.
sensor_msgs::ImageConstPtr decodeColour(const sensor_msgs::CompressedImage& message);

/// What distinguishes depth images from colour images, which all else treats alike.
struct ImageKind {
  const char* name;
  const char* ns;                ///< Of the topics image_rect and camera_info.
  const char* transport_param;   ///< The private parameter that has the transport of the images.
  const char* compressed_topic;  ///< Ending of the topic of those that are decoded here.
  sensor_msgs::ImageConstPtr (*decode)(const sensor_msgs::CompressedImage&);
  /// Whether images in a bag are hardly anything else, by encoding or by format.
  bool (*has_encoding)(const std::string&);
  bool (*has_format)(const sensor_msgs::CompressedImage&);
  /// What is wrong with an image; nothing if it is usable.
  std::optional<Rejection> (*check)(const sensor_msgs::Image&, const sensor_msgs::CameraInfo&);
  bool is_colour;
};

constexpr ImageKind kDepthImages = {
    "depth",     "depth",         "image_transport", kCompressedDepthTopic,
    decodeDepth, isDepthEncoding, holdsDepth,        checkDepthImage,
    false};
constexpr ImageKind kColourImages = {"colour",         "color",          "color_image_transport",
                                     kCompressedTopic, decodeColour,     showsColour,
                                     holdsColour,      checkColourImage, true};

}  // namespace dtsdf
