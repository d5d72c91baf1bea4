/// make_room_bag OUT.bag: a way through the analytic room, with transforms that come late.
#include <rosbag/bag.h>

#include <exception>
#include <iostream>

#include "ros/support/messages.h"
#include "simulation/scene.h"

namespace {

constexpr int kFrames = 30;
constexpr int kWidth = 96, kHeight = 72;
constexpr dtsdf::Intrinsics kIntrinsics{80.0f, 80.0f, 47.5f, 35.5f};
constexpr double kInterval_s = 0.1;
/// The transforms are recorded this much after the images they belong to.
constexpr double kLate_s = 0.15;

void writeBag(const std::string& path) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  const dtsdf::Scene scene = dtsdf::makeRoomScene();
  const ros::Time start(1000.0);
  for (int i = 0; i < kFrames; ++i) {
    const ros::Time stamp = start + ros::Duration(i * kInterval_s);
    const Eigen::Isometry3d T_W_C = dtsdf::roomCameraPose(i * kInterval_s, 6.0);
    const sensor_msgs::Image image =
        dtsdf::makeImageMessage(dtsdf::makeHeader(stamp, "camera"), "32FC1", kWidth, kHeight,
                                renderDepth(scene, kIntrinsics, kWidth, kHeight, T_W_C));
    bag.write("/camera/depth/image_rect", stamp, image);
    bag.write("/camera/depth/camera_info", stamp, dtsdf::makeCameraInfo(image, kIntrinsics));
    bag.write("/tf", stamp + ros::Duration(kLate_s),
              dtsdf::makeTfMessage("map", "camera", T_W_C, stamp));
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
