/// Writes a bag of images rendered along a path through a simulated room. Usage: make_room_bag KIND
/// OUT.bag. KIND is `late` (transforms arrive after their images), `drifting` or `covered` (see
/// room_bags.h).
#include <rosbag/bag.h>

#include <exception>
#include <iostream>
#include <stdexcept>

#include "ros/support/messages.h"
#include "ros/support/room_bags.h"
#include "simulation/scene.h"

namespace {

using dtsdf::Intrinsics;
using Eigen::Isometry3d;

struct Camera {
  int width, height;
  Intrinsics intrinsics;
};

class RoomBag {
 public:
  RoomBag(const std::string& path, const Camera& camera)
      : bag_(path, rosbag::bagmode::Write), camera_(camera) {}

  void see(const Isometry3d& T_R_C, const ros::Time& stamp) {
    write(renderDepth(room_, camera_.intrinsics, camera_.width, camera_.height, T_R_C), stamp);
  }

  void seeNothing(const ros::Time& stamp) {
    write(std::vector<float>(static_cast<size_t>(camera_.width) * camera_.height, 0.0f), stamp);
  }

  void writeTransform(const std::string& parent, const std::string& child, const Isometry3d& T,
                      const ros::Time& stamp, const ros::Time& received) {
    bag_.write("/tf", received, dtsdf::makeTfMessage(parent, child, T, stamp));
  }

 private:
  void write(const std::vector<float>& depth_m, const ros::Time& stamp) {
    const sensor_msgs::Image image = dtsdf::makeImageMessage(
        dtsdf::makeHeader(stamp, "camera"), "32FC1", camera_.width, camera_.height, depth_m);
    bag_.write("/camera/depth/image_rect", stamp, image);
    bag_.write("/camera/depth/camera_info", stamp, makeCameraInfo(image, camera_.intrinsics));
  }

  rosbag::Bag bag_;
  const Camera camera_;
  const dtsdf::Scene room_ = dtsdf::makeRoomScene();
};

void writeLate(const std::string& path) {
  constexpr int kFrames = 30;
  constexpr double kInterval_s = 0.1;
  /// Delay of each transform after its image.
  const ros::Duration late(0.15);
  RoomBag bag(path, {96, 72, {80.0f, 80.0f, 47.5f, 35.5f}});
  const ros::Time start(1000.0);
  for (int i = 0; i < kFrames; ++i) {
    const ros::Time stamp = start + ros::Duration(i * kInterval_s);
    const Isometry3d T_W_C = dtsdf::roomCameraPose(i * kInterval_s, 6.0);
    bag.see(T_W_C, stamp);
    bag.writeTransform("map", "camera", T_W_C, stamp, stamp + late);
  }
}

const Camera kCarriedCamera{160, 120, {138.0f, 138.0f, 79.5f, 59.5f}};

void writeDrifting(const std::string& path) {
  using namespace dtsdf::room_bag;
  RoomBag bag(path, kCarriedCamera);
  for (int i = 0; i < kDriftingFrames; ++i) {
    const Isometry3d T_R_B = poseAt(i) * dtsdf::mount().inverse();
    bag.writeTransform("odom", "base", driftAt(i).inverse() * T_R_B, stampOf(i), stampOf(i));
    bag.writeTransform("base", "camera", dtsdf::mount(), stampOf(i), stampOf(i));
    bag.see(poseAt(i), stampOf(i));
  }
}

void writeCovered(const std::string& path) {
  using namespace dtsdf::room_bag;
  RoomBag bag(path, kCarriedCamera);
  for (int i = 0; i < kCarried + kCovered + kHeld; ++i) {
    if (isCovered(i)) {
      bag.seeNothing(stampOf(i));
    } else {
      bag.see(i < kCarried ? poseAt(i) : heldPose(), stampOf(i));
    }
  }
}

void writeBag(const std::string& kind, const std::string& path) {
  if (kind == "late") return writeLate(path);
  if (kind == "drifting") return writeDrifting(path);
  if (kind == "covered") return writeCovered(path);
  throw std::runtime_error("unknown kind: " + kind);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: make_room_bag late|drifting|covered OUT.bag\n";
    return 2;
  }
  try {
    writeBag(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::cerr << "make_room_bag: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
