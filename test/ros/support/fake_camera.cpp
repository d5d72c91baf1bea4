#include "ros/support/fake_camera.h"

#include <geometry_msgs/TransformStamped.h>
#include <tf2_msgs/TFMessage.h>

#include <cstring>

#include "ros/input/transform_conversions.h"
#include "ros/support/kept_topics.h"
#include "ros/support/wait.h"

namespace dtsdf {

FakeCamera::FakeCamera(ros::NodeHandle nh)
    : images_(advertiseKept<sensor_msgs::Image>(nh, "/camera/depth/image_rect")),
      infos_(advertiseKept<sensor_msgs::CameraInfo>(nh, "/camera/depth/camera_info")),
      transforms_(advertiseKept<tf2_msgs::TFMessage>(nh, "/tf")) {}

bool FakeCamera::connect() const {
  return waitUntil([&] {
    return images_.getNumSubscribers() > 0 && infos_.getNumSubscribers() > 0 &&
           transforms_.getNumSubscribers() > 0;
  });
}

ros::Time FakeCamera::nextStamp() {
  const ros::Time now = ros::Time::now();
  const ros::Time soonest = last_stamp_ + ros::Duration(0.01);
  last_stamp_ = now > soonest ? now : soonest;
  return last_stamp_;
}

sensor_msgs::Image FakeCamera::image(const ros::Time& stamp) const {
  sensor_msgs::Image image;
  image.header.stamp = stamp;
  image.header.frame_id = "camera";
  image.width = kWidth;
  image.height = kHeight;
  image.encoding = "32FC1";
  image.step = kWidth * sizeof(float);
  image.data.resize(kHeight * image.step);
  const float depth_m = 1.0f;
  for (size_t i = 0; i < image.data.size(); i += sizeof(float)) {
    std::memcpy(&image.data[i], &depth_m, sizeof(float));
  }
  return image;
}

sensor_msgs::CameraInfo FakeCamera::info(const ros::Time& stamp) const {
  sensor_msgs::CameraInfo info;
  info.header.stamp = stamp;
  info.header.frame_id = "camera";
  info.width = kWidth;
  info.height = kHeight;
  info.P = {60.0, 0.0, 31.5, 0.0, 0.0, 60.0, 23.5, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

void FakeCamera::send(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info) const {
  infos_.publish(info);
  images_.publish(image);
}

void FakeCamera::sendTransform(const ros::Time& stamp, const Eigen::Vector3d& t_W,
                               const std::string& frame) {
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = stamp;
  transform.header.frame_id = "map";
  transform.child_frame_id = frame;
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.translation() = t_W;
  transform.transform = toTransform(T_W_C);
  broadcaster_.sendTransform(transform);
}

ros::Time FakeCamera::sendFrame() {
  const ros::Time stamp = nextStamp();
  sendTransform(stamp);
  send(image(stamp), info(stamp));
  return stamp;
}

}  // namespace dtsdf
