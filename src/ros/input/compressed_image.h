/// From messages of image_transport's compressed images to images, without its plugins.
#pragma once

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <string>

namespace dtsdf {

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

}  // namespace dtsdf
