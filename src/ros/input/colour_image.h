/// From sensor_msgs to the mapper's colour frame: what is accepted, and what it becomes.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <optional>
#include <string>

#include "dtsdf_mapping/colour_frame.h"
#include "ros/input/image_checks.h"

namespace dtsdf {

/// rgb8, bgr8, rgba8, bgra8, mono8, mono16, Bayer of 8 and 16 bits, YUV 4:2:2 (yuv422,
/// yuv422_yuy2).
bool isColourEncoding(const std::string& encoding);

/// Whether images of this encoding are hardly anything but a colour camera's: mono8 may be
/// infrared, mono16 depth.
bool showsColour(const std::string& encoding);

/// What is wrong with an image, judged by its header and its camera_info; nothing if it is usable.
std::optional<Rejection> checkColourImage(const sensor_msgs::Image& image,
                                          const sensor_msgs::CameraInfo& info);

/// The frame of an image that passed checkColourImage(), without its pose. Its data live in
/// `pixels`, which shares them with the message where the mapper knows the encoding, or has them
/// converted by cv_bridge.
/// @throws cv_bridge::Exception or cv::Exception for what cannot be converted, such as a Bayer
/// image of one pixel.
ColourFrame makeColourFrame(const sensor_msgs::ImageConstPtr& image,
                            const sensor_msgs::CameraInfo& info,
                            cv_bridge::CvImageConstPtr& pixels);

}  // namespace dtsdf
