/// What depth and colour images have in common: their camera, and whether their bytes fit it.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cstddef>
#include <optional>

#include "dtsdf_mapping/pinhole.h"
#include "ros/input/drop_reason.h"

namespace dtsdf {

/// Intrinsics of a rectified image: P, or K where P is empty, with binning and the region of
/// interest applied.
Intrinsics intrinsicsOf(const sensor_msgs::CameraInfo& info);

/// The camera_info of a rectified image with these intrinsics.
sensor_msgs::CameraInfo makeCameraInfo(const sensor_msgs::Image& image, const Intrinsics& K);

/// Whether an image may wait at all, by its size; nothing if it may. `most_bytes` is all the room.
std::optional<Rejection> checkArrival(const sensor_msgs::Image& image, size_t most_bytes);

/// What is wrong with an image of so many bytes a pixel and its camera_info; nothing if they fit.
std::optional<Rejection> checkImage(const sensor_msgs::Image& image,
                                    const sensor_msgs::CameraInfo& info, size_t pixel_bytes);

/// The image as cv_bridge and OpenCV take it: without padding where it is of no whole pixels, or
/// where there is more or less of it than the rows need. One that passed checkImage().
sensor_msgs::ImageConstPtr tidied(const sensor_msgs::ImageConstPtr& image, size_t pixel_bytes);

}  // namespace dtsdf
