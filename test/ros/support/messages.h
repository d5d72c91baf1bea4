/// Builds image and transform messages.
#pragma once

#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <cstring>
#include <string>
#include <vector>

#include "ros/input/conversions.h"
#include "ros/input/images.h"  // makeCameraInfo()

namespace dtsdf {

inline std_msgs::Header makeHeader(const ros::Time& stamp, const std::string& frame) {
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = frame;
  return header;
}

/// An image without padding, in native byte order.
template <class Pixel>
sensor_msgs::Image makeImageMessage(const std_msgs::Header& header, const std::string& encoding,
                                    int width, int height, const std::vector<Pixel>& pixels) {
  sensor_msgs::Image image;
  image.header = header;
  image.encoding = encoding;
  image.width = static_cast<uint32_t>(width);
  image.height = static_cast<uint32_t>(height);
  image.data.resize(pixels.size() * sizeof(Pixel));
  image.step = static_cast<uint32_t>(image.data.size() / image.height);
  std::memcpy(image.data.data(), pixels.data(), image.data.size());
  return image;
}

/// A message with one transform, as on /tf.
inline tf2_msgs::TFMessage makeTfMessage(const std::string& parent, const std::string& child,
                                         const Eigen::Isometry3d& T, const ros::Time& stamp) {
  tf2_msgs::TFMessage message;
  message.transforms.push_back(makeTransform(parent, child, T, stamp));
  return message;
}

}  // namespace dtsdf
