/// Masks: what of a depth image is not of the scene, such as the robot's own arm.
#pragma once

#include <sensor_msgs/Image.h>

#include <optional>

#include "ros/input/drop_reason.h"

namespace dtsdf {

/// What is wrong with a mask for a depth image that passed checkDepthImage(); nothing if it is
/// usable.
std::optional<Rejection> checkMask(const sensor_msgs::Image& mask, const sensor_msgs::Image& depth);

/// The depth image without measurements where the mask is not 0. Both have passed their checks.
sensor_msgs::ImageConstPtr applyMask(const sensor_msgs::Image& mask,
                                     const sensor_msgs::Image& depth);

}  // namespace dtsdf
