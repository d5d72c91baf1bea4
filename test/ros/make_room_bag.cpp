/// make_room_bag OUT.bag: a way through the analytic room, with transforms that come late.
#include <geometry_msgs/TransformStamped.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <cstring>
#include <exception>
#include <iostream>

#include "ros/input/transform_conversions.h"
#include "simulation/scene.h"

namespace {

constexpr int kFrames = 30;
constexpr int kWidth = 96, kHeight = 72;
constexpr float kFocal_px = 80.0f;
constexpr double kInterval_s = 0.1;
/// The transforms are recorded this much after the images they belong to.
constexpr double kLate_s = 0.15;

std_msgs::Header makeHeader(const ros::Time& stamp, const std::string& frame) {
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = frame;
  return header;
}

sensor_msgs::Image makeImage(const std::vector<float>& depth_m, const ros::Time& stamp) {
  sensor_msgs::Image image;
  image.header = makeHeader(stamp, "camera");
  image.width = kWidth;
  image.height = kHeight;
  image.encoding = "32FC1";
  image.step = kWidth * sizeof(float);
  image.data.resize(image.step * kHeight);
  std::memcpy(image.data.data(), depth_m.data(), image.data.size());
  return image;
}

sensor_msgs::CameraInfo makeInfo(const sensor_msgs::Image& image) {
  sensor_msgs::CameraInfo info;
  info.header = image.header;
  info.width = kWidth;
  info.height = kHeight;
  info.P = {kFocal_px, 0.0, 47.5, 0.0, 0.0, kFocal_px, 35.5, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

tf2_msgs::TFMessage makeTransform(const Eigen::Isometry3d& T_W_C, const ros::Time& stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header = makeHeader(stamp, "map");
  transform.child_frame_id = "camera";
  transform.transform = dtsdf::toTransform(T_W_C);
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform);
  return message;
}

void writeBag(const std::string& path) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  const dtsdf::Scene scene = dtsdf::makeRoomScene();
  const ros::Time start(1000.0);
  for (int i = 0; i < kFrames; ++i) {
    const ros::Time stamp = start + ros::Duration(i * kInterval_s);
    const Eigen::Isometry3d T_W_C = dtsdf::roomCameraPose(i * kInterval_s, 6.0);
    const sensor_msgs::Image image =
        makeImage(renderDepth(scene, {kFocal_px, kFocal_px, 47.5f, 35.5f}, kWidth, kHeight, T_W_C),
                  stamp);
    bag.write("/camera/depth/image_rect", stamp, image);
    bag.write("/camera/depth/camera_info", stamp, makeInfo(image));
    bag.write("/tf", stamp + ros::Duration(kLate_s), makeTransform(T_W_C, stamp));
  }
  bag.close();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_room_bag OUT.bag\n";
    return 2;
  }
  try {
    writeBag(argv[1]);
  } catch (const std::exception& error) {
    std::cerr << "make_room_bag: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
