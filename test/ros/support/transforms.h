/// Transforms, images and camera_info for tests without a ROS master.
#pragma once

#include <boost/make_shared.hpp>
#include <string>
#include <vector>

#include "ros/input/transforms.h"
#include "ros/support/messages.h"

namespace dtsdf {

/// Puts `child` at (x, 0, 0) in `parent`, without rotation.
inline void putTransform(Transforms& transforms, double stamp_s, double x,
                         const std::string& child = "camera", const std::string& parent = "map") {
  const Eigen::Isometry3d T(Eigen::Translation3d(x, 0.0, 0.0));
  transforms.take(makeTransform(parent, child, T, ros::Time(stamp_s)), "test");
}

/// An image of 4 x 2 pixels, all with a depth of 1 m.
inline sensor_msgs::ImagePtr makeDepthImage(double stamp_s, const std::string& frame = "camera") {
  return boost::make_shared<sensor_msgs::Image>(makeImageMessage(
      makeHeader(ros::Time(stamp_s), frame), "16UC1", 4, 2, std::vector<uint16_t>(8, 1000)));
}

/// A mask for an image from makeDepthImage().
inline sensor_msgs::ImagePtr makeMask(double stamp_s, const std::vector<uint8_t>& pixels) {
  const auto mask = boost::make_shared<sensor_msgs::Image>(
      makeImageMessage(makeHeader(ros::Time(stamp_s), ""), "mono8", 4, 2, pixels));
  mask->step = 4;  // even if `pixels` has a different size
  return mask;
}

inline sensor_msgs::CameraInfoPtr makeCameraInfo(double stamp_s) {
  return boost::make_shared<sensor_msgs::CameraInfo>(
      makeCameraInfo(*makeDepthImage(stamp_s, ""), {5.0f, 5.0f, 1.5f, 0.5f}));
}

}  // namespace dtsdf
