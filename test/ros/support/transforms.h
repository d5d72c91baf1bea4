/// Transforms and depth images as they would come over topics, for tests without a master.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <boost/make_shared.hpp>
#include <string>
#include <vector>

namespace dtsdf {

/// The camera stands at (x, 0, 0) of its parent, not turned.
template <class Buffer>
void putTransform(Buffer& transforms, double stamp_s, double x,
                         const std::string& child = "camera", const std::string& parent = "map") {
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = ros::Time(stamp_s);
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  transform.transform.translation.x = x;
  transform.transform.rotation.w = 1.0;
  transforms.setTransform(transform, "test");
}

/// 4 x 2 pixels of one metre.
inline sensor_msgs::ImagePtr makeDepthImage(double stamp_s, const std::string& frame = "camera") {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.stamp = ros::Time(stamp_s);
  image->header.frame_id = frame;
  image->encoding = "16UC1";
  image->width = 4;
  image->height = 2;
  image->step = 8;
  for (int i = 0; i < 8; ++i) {
    image->data.push_back(1000 & 0xff);
    image->data.push_back(1000 >> 8);
  }
  return image;
}

/// A mask for it.
inline sensor_msgs::ImagePtr makeMask(double stamp_s, const std::vector<uint8_t>& pixels) {
  const auto mask = boost::make_shared<sensor_msgs::Image>();
  mask->header.stamp = ros::Time(stamp_s);
  mask->encoding = "mono8";
  mask->width = 4;
  mask->height = 2;
  mask->step = 4;
  mask->data = pixels;
  return mask;
}

inline sensor_msgs::CameraInfoPtr makeCameraInfo(double stamp_s) {
  const auto info = boost::make_shared<sensor_msgs::CameraInfo>();
  info->header.stamp = ros::Time(stamp_s);
  info->width = 4;
  info->height = 2;
  info->P = {5.0, 0.0, 1.5, 0.0, 0.0, 5.0, 0.5, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

}  // namespace dtsdf
