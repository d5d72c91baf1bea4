/// Tests the published rendering of the map from the camera's pose.
#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <vector>

#include "ros/support/room_camera.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

constexpr double kViewPeriod_s = 0.05;

class ViewWatcher {
 public:
  explicit ViewWatcher(ros::NodeHandle nh)
      : images_(nh.subscribe<sensor_msgs::Image>(
            "/mapping/rendered/image", 100,
            [this](const sensor_msgs::ImageConstPtr& image) { image_ = image; })),
        infos_(nh.subscribe<sensor_msgs::CameraInfo>(
            "/mapping/rendered/camera_info", 100,
            [this](const sensor_msgs::CameraInfoConstPtr& info) { info_ = info; })) {}

  bool isConnected() const {
    return images_.getNumPublishers() > 0 && infos_.getNumPublishers() > 0;
  }
  bool isComplete() const { return image_ && info_ && image_->header.stamp == info_->header.stamp; }
  const sensor_msgs::Image& image() const { return *image_; }
  const sensor_msgs::CameraInfo& info() const { return *info_; }

 private:
  sensor_msgs::ImageConstPtr image_;
  sensor_msgs::CameraInfoConstPtr info_;
  ros::Subscriber images_, infos_;
};

std::vector<float> depthOf(const sensor_msgs::Image& image) {
  std::vector<float> depth_m(image.data.size() / sizeof(float));
  std::memcpy(depth_m.data(), image.data.data(), image.data.size());
  return depth_m;
}

TEST(RenderedView, IsWhatTheCameraSees) {
  ros::NodeHandle nh;
  const StatusWatcher status(nh);
  const OdometryWatcher listens_to_tf(nh);
  RoomCamera camera(nh);
  ASSERT_TRUE(camera.connect());
  ASSERT_TRUE(waitUntil([&] { return status.received(); }));
  const ros::Time start = ros::Time::now();
  std::map<ros::Time, Eigen::Isometry3d> poses;
  int frames = 0;
  const auto see = [&] {
    const ros::Time stamp = start + ros::Duration(kViewPeriod_s * frames);
    poses[stamp] = roomCameraPose(kViewPeriod_s * frames++);
    camera.sendTransform("map", "camera", poses[stamp], stamp);
    camera.see(poses[stamp], stamp);
  };
  for (int i = 0; i < 20; ++i) see();
  ASSERT_TRUE(status.waitForFused(20)) << status.status().message;

  const ViewWatcher views(nh);
  ASSERT_TRUE(waitUntil([&] { return views.isConnected(); }));
  ASSERT_TRUE(waitUntil([&] {
    if (!views.isComplete()) see();
    ros::Duration(kViewPeriod_s).sleep();
    return views.isComplete();
  })) << status.status().message;

  const sensor_msgs::Image& image = views.image();
  const sensor_msgs::CameraInfo& info = views.info();
  EXPECT_EQ(image.header.frame_id, "camera");
  EXPECT_EQ(info.header.frame_id, "camera");
  EXPECT_EQ(image.encoding, "32FC1");
  EXPECT_EQ(image.width, info.width);
  EXPECT_EQ(image.height, info.height);
  EXPECT_EQ(image.step, image.width * sizeof(float));
  ASSERT_EQ(poses.count(image.header.stamp), 1u);
  const std::vector<float> rendered = depthOf(image);
  ASSERT_EQ(rendered.size(), static_cast<size_t>(image.width) * image.height);
  const Intrinsics K{static_cast<float>(info.K[0]), static_cast<float>(info.K[4]),
                     static_cast<float>(info.K[2]), static_cast<float>(info.K[5])};
  const std::vector<float> truth =
      renderDepth(makeRoomScene(), K, static_cast<int>(image.width), static_cast<int>(image.height),
                  poses[image.header.stamp]);
  std::vector<float> errors_m;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (!std::isnan(rendered[i])) {
      EXPECT_GT(rendered[i], 0.0f);
      errors_m.push_back(std::abs(rendered[i] - truth[i]));
    }
  }
  EXPECT_GT(errors_m.size(), truth.size() * 9 / 10);
  std::nth_element(errors_m.begin(), errors_m.begin() + errors_m.size() / 2, errors_m.end());
  EXPECT_LT(errors_m[errors_m.size() / 2], 0.004f);  // a tenth of a voxel
}

}  // namespace
}  // namespace dtsdf
