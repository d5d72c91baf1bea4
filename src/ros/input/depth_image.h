/// From sensor_msgs to the mapper's depth frame: what is accepted, and with what unit.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "ros/input/drop_reason.h"

namespace dtsdf {

struct DepthUnits {
  float unit_16uc1_m = 0.001f;
  float unit_32fc1_m = 1.0f;
};

/// Intrinsics of a rectified image: P, or K where P is empty, with binning and the region of
/// interest applied.
Intrinsics intrinsicsOf(const sensor_msgs::CameraInfo& info);

/// What is wrong with an image, judged by its header and its camera_info; nothing if it is usable.
std::optional<Rejection> checkDepthImage(const sensor_msgs::Image& image,
                                         const sensor_msgs::CameraInfo& info);

/// The frame of an image that passed checkDepthImage(), without its pose. Its data points into the
/// image, or into `repacked` where the byte order or the rows are not the machine's.
DepthFrame makeDepthFrame(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info,
                          const DepthUnits& units, std::vector<uint8_t>& repacked);

}  // namespace dtsdf
