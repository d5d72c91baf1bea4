/// Tests that valid compressed depth images are fused and damaged ones are dropped and counted.
#include <gtest/gtest.h>
#include <image_transport/image_transport.h>
#include <sensor_msgs/CompressedImage.h>

#include <algorithm>

#include "ros/support/fake_camera.h"
#include "ros/support/kept_topics.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"
#include "support/compressed_depth.h"

namespace dtsdf {
namespace {

class Compressed : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(waitUntil([&] {
      return images_.getNumSubscribers() > 0 && infos_.getNumSubscribers() > 0 &&
             status_.received();
    }));
  }

  bool hasPlugin() const {
    const auto plugins = image_transport::ImageTransport(nh_).getLoadableTransports();
    return std::find(plugins.begin(), plugins.end(), "image_transport/compressedDepth") !=
           plugins.end();
  }

  /// Sends an image with its camera_info and transform.
  ros::Time send(const std::string& format, const std::vector<uint8_t>& data) {
    const ros::Time stamp = camera_.nextStamp();
    camera_.sendTransform(stamp);
    sensor_msgs::CompressedImage message;
    message.header.stamp = stamp;
    message.header.frame_id = "camera";
    message.format = format;
    message.data = data;
    infos_.publish(camera_.info(stamp));
    images_.publish(message);
    return stamp;
  }

  void expectFused(const std::string& format, const std::vector<uint8_t>& data) {
    const ros::Time stamp = send(format, data);
    EXPECT_TRUE(waitUntil([&] { return status_.status().last_fused_stamp == stamp; }))
        << format << ": " << status_.status().message;
  }

  ros::NodeHandle nh_;
  FakeCamera camera_{nh_};
  ros::Publisher images_ = advertiseUntilExit<sensor_msgs::CompressedImage>(
      nh_, "/camera/depth/image_rect/compressedDepth");
  ros::Publisher infos_ =
      advertiseUntilExit<sensor_msgs::CameraInfo>(nh_, "/camera/depth/camera_info");
  StatusWatcher status_{nh_};
};

TEST_F(Compressed, BothCodecsAndEncodingsAreFused) {
  const std::vector<uint16_t> pixels(FakeCamera::kWidth * FakeCamera::kHeight, 1000);
  const cv::Mat image(FakeCamera::kHeight, FakeCamera::kWidth, CV_16UC1, cv::Scalar(1000));
  // With this header, a value of 1000 means one metre.
  const std::vector<uint8_t> inverse = compressedHeader(1000.0f, 0.0f);
  expectFused("16UC1; compressedDepth rvl", compressRvl(pixels, FakeCamera::kWidth));
  expectFused("32FC1; compressedDepth png", compressPng(image, inverse));
}

TEST_F(Compressed, DamagedImagesAreCounted) {
  if (hasPlugin()) GTEST_SKIP() << "the compressedDepth plugin is installed and decodes the images";
  std::vector<uint8_t> huge = compressedHeader();
  for (int i = 0; i < 8; ++i) huge.push_back(0xff);
  const std::pair<std::string, std::vector<uint8_t>> damaged[] = {
      {"16UC1; compressedDepth rvl", huge},
      {"16UC1; compressedDepth png", huge},
      {"16UC1; compressedDepth rvl", {}},
      {"bgr8; jpeg compressed bgr8", huge}};
  for (const auto& [format, data] : damaged) {
    const uint64_t dropped = status_.dropped("bad_image");
    send(format, data);
    EXPECT_TRUE(status_.waitForDrop("bad_image", dropped)) << format;
  }
}

}  // namespace
}  // namespace dtsdf
