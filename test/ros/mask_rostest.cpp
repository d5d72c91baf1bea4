/// Tests images with masks. A single camera_info message is used for all images.
#include <gtest/gtest.h>

#include "ros/support/fake_camera.h"
#include "ros/support/kept_topics.h"
#include "ros/support/messages.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

class Mask : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(camera_.connect());
    ASSERT_TRUE(waitUntil([&] { return masks_.getNumSubscribers() > 0 && status_.received(); }));
  }

  /// Sends an image with its transform, but without camera_info.
  void sendDepth(const ros::Time& stamp) {
    camera_.sendTransform(stamp);
    depths_.publish(camera_.image(stamp));
  }

  void sendMask(const ros::Time& stamp, uint8_t value) {
    masks_.publish(
        makeImageMessage(makeHeader(stamp, ""), "mono8", FakeCamera::kWidth, FakeCamera::kHeight,
                         std::vector<uint8_t>(FakeCamera::kWidth * FakeCamera::kHeight, value)));
  }

  ros::NodeHandle nh_;
  FakeCamera camera_{nh_};
  ros::Publisher depths_ = advertiseUntilExit<sensor_msgs::Image>(nh_, "/camera/depth/image_rect");
  ros::Publisher masks_ = advertiseUntilExit<sensor_msgs::Image>(nh_, "/camera/mask/image");
  StatusWatcher status_{nh_};
};

TEST_F(Mask, FramesAreFusedWithTheirMasks) {
  const ros::Time first = camera_.nextStamp();
  camera_.sendTransform(first);
  camera_.send(camera_.image(first), camera_.info(first));  // the only camera_info
  sendMask(first, 0);
  EXPECT_TRUE(waitUntil([&] { return status_.status().last_fused_stamp == first; }))
      << status_.status().message;
  const ros::Time second = camera_.nextStamp();
  sendMask(second, 0);
  sendDepth(second);
  EXPECT_TRUE(waitUntil([&] { return status_.status().last_fused_stamp == second; }))
      << status_.status().message;
}

TEST_F(Mask, AFullMaskHidesEverything) {
  const uint64_t dropped = status_.dropped("no_measurement");
  const ros::Time stamp = camera_.nextStamp();
  sendDepth(stamp);
  sendMask(stamp, 255);
  EXPECT_TRUE(status_.waitForDrop("no_measurement", dropped));
}

TEST_F(Mask, AMissingMaskDropsTheFrame) {
  const uint64_t dropped = status_.dropped("no_mask");
  sendDepth(camera_.nextStamp());
  const ros::Time stamp = camera_.nextStamp();
  sendDepth(stamp);
  sendMask(stamp, 0);
  EXPECT_TRUE(status_.waitForDrop("no_mask", dropped));
  EXPECT_TRUE(waitUntil([&] { return status_.status().last_fused_stamp == stamp; }));
}

}  // namespace
}  // namespace dtsdf
