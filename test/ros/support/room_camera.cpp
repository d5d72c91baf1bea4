#include "ros/support/room_camera.h"

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <cstring>

#include "ros/input/transform_conversions.h"
#include "ros/support/kept_topics.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 160, kHeight = 120;
const Intrinsics kRoomIntrinsics{138.0f, 138.0f, 79.5f, 59.5f};

}  // namespace

RoomCamera::RoomCamera(ros::NodeHandle nh)
    : room_(makeRoomScene()),
      images_(advertiseKept<sensor_msgs::Image>(nh, "/camera/depth/image_rect")),
      infos_(advertiseKept<sensor_msgs::CameraInfo>(nh, "/camera/depth/camera_info")),
      transforms_(advertiseKept<tf2_msgs::TFMessage>(nh, "/tf")) {}

bool RoomCamera::connect() const {
  return waitUntil([&] {
    return images_.getNumSubscribers() > 0 && infos_.getNumSubscribers() > 0 &&
           transforms_.getNumSubscribers() > 1;  // the test itself is one
  });
}

void RoomCamera::see(const Eigen::Isometry3d& T_R_C, const ros::Time& stamp) {
  send(renderDepth(room_, kRoomIntrinsics, kWidth, kHeight, T_R_C), stamp);
}

void RoomCamera::seeNothing(const ros::Time& stamp) {
  send(std::vector<float>(kWidth * kHeight, 0.0f), stamp);
}

void RoomCamera::send(const std::vector<float>& depth_m, const ros::Time& stamp) {
  sensor_msgs::Image image;
  image.header.stamp = stamp;
  image.header.frame_id = "camera";
  image.width = kWidth;
  image.height = kHeight;
  image.encoding = "32FC1";
  image.step = kWidth * sizeof(float);
  image.data.resize(depth_m.size() * sizeof(float));
  std::memcpy(image.data.data(), depth_m.data(), image.data.size());
  sensor_msgs::CameraInfo info;
  info.header = image.header;
  info.width = kWidth;
  info.height = kHeight;
  info.P = {138.0, 0.0, 79.5, 0.0, 0.0, 138.0, 59.5, 0.0, 0.0, 0.0, 1.0, 0.0};
  infos_.publish(info);
  images_.publish(image);
}

void RoomCamera::sendTransform(const std::string& parent, const std::string& child,
                               const Eigen::Isometry3d& T, const ros::Time& stamp) {
  tf2_msgs::TFMessage message;
  message.transforms.resize(1);
  message.transforms[0].header.stamp = stamp;
  message.transforms[0].header.frame_id = parent;
  message.transforms[0].child_frame_id = child;
  message.transforms[0].transform = toTransform(T);
  transforms_.publish(message);
}

WayWatcher::WayWatcher(ros::NodeHandle nh)
    : odometry_topic_(
          nh.subscribe<nav_msgs::Odometry>("/mapping/odometry", 1000,
                                           [this](const nav_msgs::Odometry::ConstPtr& message) {
                                             odometry_ = *message;
                                             ++count_;
                                           })),
      path_topic_(nh.subscribe<nav_msgs::Path>(
          "/mapping/path", 10,
          [this](const nav_msgs::Path::ConstPtr& message) { path_ = *message; })) {}

bool WayWatcher::waitFor(const ros::Time& stamp) const {
  return waitUntil([&] { return odometry_.header.stamp == stamp; });
}

Eigen::Isometry3d WayWatcher::pose() const {
  const geometry_msgs::Pose& pose = odometry_.pose.pose;
  geometry_msgs::Transform transform;
  transform.translation.x = pose.position.x;
  transform.translation.y = pose.position.y;
  transform.translation.z = pose.position.z;
  transform.rotation = pose.orientation;
  return toIsometry(transform);
}

std::optional<Eigen::Isometry3d> WayWatcher::transform(const std::string& parent,
                                                       const std::string& child,
                                                       const ros::Time& stamp) const {
  if (!waitUntil([&] { return buffer_.canTransform(parent, child, stamp); }, 10.0)) {
    return std::nullopt;
  }
  return toIsometry(buffer_.lookupTransform(parent, child, stamp).transform);
}

double shiftBetween_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

double turnBetween_rad(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

}  // namespace dtsdf
