/// From sensor_msgs to the mapper's depth frame: what is accepted, and with what unit.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <optional>
#include <string>

#include "ros/input/image_checks.h"

namespace dtsdf {

struct DepthUnits {
  float unit_16uc1_m = 0.001f;
  float unit_32fc1_m = 1.0f;
};

/// 16UC1, mono16 or 32FC1.
bool isDepthEncoding(const std::string& encoding);

/// What is wrong with an image, judged by its header and its camera_info; nothing if it is usable.
std::optional<Rejection> checkDepthImage(const sensor_msgs::Image& image,
                                         const sensor_msgs::CameraInfo& info);

/// The frame of an image that passed checkDepthImage(), without its pose. Its data live in
/// `pixels`, which shares them with the message, or has a copy where the byte order is not the
/// machine's or the rows are of no whole pixels.
/// @throws cv_bridge::Exception or cv::Exception for what the check should have refused.
DepthFrame makeDepthFrame(const sensor_msgs::ImageConstPtr& image,
                          const sensor_msgs::CameraInfo& info, const DepthUnits& units,
                          cv_bridge::CvImageConstPtr& pixels);

}  // namespace dtsdf
