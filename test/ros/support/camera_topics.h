/// Publishers of the image topics of a camera, which remain advertised between tests.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <string>

#include "ros/support/kept_topics.h"

namespace dtsdf {

class CameraTopics {
 public:
  /// Publishes `ns`/image_rect and `ns`/camera_info.
  CameraTopics(ros::NodeHandle nh, const std::string& ns)
      : images_(advertiseUntilExit<sensor_msgs::Image>(nh, ns + "/image_rect")),
        infos_(advertiseUntilExit<sensor_msgs::CameraInfo>(nh, ns + "/camera_info")) {}

  /// Whether at least this many mappers have subscribed.
  bool isConnected(uint32_t mappers = 1) const {
    return images_.getNumSubscribers() >= mappers && infos_.getNumSubscribers() >= mappers;
  }

  void send(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info) const {
    infos_.publish(info);
    images_.publish(image);
  }

 private:
  ros::Publisher images_, infos_;
};

}  // namespace dtsdf
