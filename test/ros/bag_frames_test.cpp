/// Bags with compressed depth, written here: what is read of them offline.
#include "io/bag_frames.h"

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include "support/compressed_depth.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 8, kHeight = 6, kFrames = 3;
const std::string kTopic = "/camera/depth/image_rect";
const std::string kCompressedTopic = kTopic + "/compressedDepth";

std_msgs::Header headerOf(int i) {
  std_msgs::Header header;
  header.stamp = ros::Time(100.0 + i);
  header.frame_id = "camera";
  return header;
}

cv::Mat depthOf(int i) {
  cv::Mat depth(kHeight, kWidth, CV_16UC1);
  for (int p = 0; p < kWidth * kHeight; ++p) {
    depth.at<uint16_t>(p / kWidth, p % kWidth) = static_cast<uint16_t>(p == 0 ? 0 : 1000 * i + p);
  }
  return depth;
}

sensor_msgs::Image rawOf(int i) {
  const cv::Mat depth = depthOf(i);
  sensor_msgs::Image image;
  image.header = headerOf(i);
  image.width = kWidth;
  image.height = kHeight;
  image.encoding = "16UC1";
  image.step = 2 * kWidth;
  image.data.assign(depth.datastart, depth.dataend);
  return image;
}

/// By turns in the codes that there are.
sensor_msgs::CompressedImage compressedOf(int i) {
  const cv::Mat depth = depthOf(i);
  sensor_msgs::CompressedImage image;
  image.header = headerOf(i);
  image.format = i % 2 == 0 ? "16UC1; compressedDepth" : "16UC1; compressedDepth rvl";
  image.data = i % 2 == 0
                   ? compressPng(depth)
                   : compressRvl({depth.begin<uint16_t>(), depth.end<uint16_t>()}, kWidth);
  return image;
}

class CompressedBag : public testing::Test {
 protected:
  void SetUp() override {
    options_.path = folder_ / "a.bag";
    bag_.open(options_.path, rosbag::bagmode::Write);
    for (int i = 0; i < kFrames; ++i) writeRest(i);
  }

  void writeRest(int i) {
    const ros::Time stamp = headerOf(i).stamp;
    sensor_msgs::CameraInfo info;
    info.header = headerOf(i);
    info.width = kWidth;
    info.height = kHeight;
    info.K = {10.0, 0.0, 3.5, 0.0, 10.0, 2.5, 0.0, 0.0, 1.0};
    info.distortion_model = "plumb_bob";  // of the camera; the topic says that it is undone
    info.D = {0.9, 0.0, 0.0, 0.0, 0.0};
    bag_.write("/camera/depth/camera_info", stamp, info);
    geometry_msgs::TransformStamped transform;
    transform.header = headerOf(i);
    transform.header.frame_id = "map";
    transform.child_frame_id = "camera";
    transform.transform.rotation.w = 1.0;
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    bag_.write("/tf", stamp, message);
    sensor_msgs::CompressedImage colour;
    colour.header = headerOf(i);
    colour.format = "bgr8; jpeg compressed bgr8";
    bag_.write("/camera/rgb/image_rect_color/compressed", stamp, colour);
  }

  void writeCompressed() {
    for (int i = 0; i < kFrames; ++i) {
      bag_.write(kCompressedTopic, headerOf(i).stamp, compressedOf(i));
    }
  }

  std::vector<SourceFrame> read() {
    bag_.close();
    source_ = openBagFrames(options_);
    std::vector<SourceFrame> frames;
    while (auto frame = source_->next()) frames.push_back(std::move(*frame));
    return frames;
  }

  static void expectFrames(const std::vector<SourceFrame>& frames) {
    ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
    for (int i = 0; i < kFrames; ++i) {
      const DepthFrame& depth = frames[static_cast<size_t>(i)].depth;
      EXPECT_EQ(depth.encoding, DepthEncoding::kUint16);
      EXPECT_EQ(depth.row_bytes, 2u * kWidth);
      EXPECT_EQ(std::memcmp(depth.data, depthOf(i).data, 2 * kWidth * kHeight), 0) << i;
    }
  }

  TemporaryFolder folder_;
  BagOptions options_;
  rosbag::Bag bag_;
  std::unique_ptr<FrameSource> source_;
};

TEST_F(CompressedBag, GivesTheImagesThatWereCompressed) {
  writeCompressed();
  expectFrames(read());
  EXPECT_TRUE(source_->skipped().empty());
}

TEST_F(CompressedBag, ImagesRecordedBothWaysCountOnce) {
  writeCompressed();
  for (int i = 0; i < kFrames; ++i) bag_.write(kTopic, headerOf(i).stamp, rawOf(i));
  expectFrames(read());
}

TEST_F(CompressedBag, TopicMayBeNamedEitherWay) {
  writeCompressed();
  options_.depth_topic = kTopic;
  expectFrames(read());
  options_.depth_topic = kCompressedTopic;
  expectFrames(read());
}

TEST_F(CompressedBag, MasksTakeMeasurementsAway) {
  writeCompressed();
  for (int i = 0; i < 2; ++i) {  // the last image has none
    sensor_msgs::Image mask;
    mask.header = headerOf(i);
    mask.encoding = "mono8";
    mask.width = mask.step = kWidth;
    mask.height = i == 0 ? kHeight : kHeight + 1;
    mask.data.assign(mask.step * mask.height, 0);
    mask.data[9] = 255;
    bag_.write("/mask", headerOf(i).stamp + ros::Duration(0.3), mask);
  }
  options_.mask_topic = "/mask";
  const std::vector<SourceFrame> frames = read();
  ASSERT_EQ(frames.size(), 1u);
  const auto* pixels = static_cast<const uint16_t*>(frames[0].depth.data);
  EXPECT_EQ(pixels[8], depthOf(0).at<uint16_t>(1, 0));
  EXPECT_EQ(pixels[9], 0);
  EXPECT_EQ(source_->skipped(),
            (std::map<std::string, size_t>{{"no_mask", 1}, {"size_mismatch", 1}}));
  options_.mask_topic = "/none";
  EXPECT_NE(errorOf([&] { openBagFrames(options_); }).find("'/none'"), std::string::npos);
}

TEST_F(CompressedBag, ImagesAreRectifiedWhereThatIsAsked) {
  writeCompressed();
  options_.rectify = true;
  const std::vector<SourceFrame> frames = read();
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  const DepthFrame& depth = frames[1].depth;
  EXPECT_EQ(depth.intrinsics.fx, 10.0f);
  EXPECT_NE(std::memcmp(depth.data, depthOf(1).data, 2 * kWidth * kHeight), 0);
  const auto* pixels = static_cast<const uint16_t*>(depth.data);
  EXPECT_EQ(pixels[2 * kWidth + 3], depthOf(1).at<uint16_t>(2, 3)) << "the middle stays";
}

TEST_F(CompressedBag, LatestCameraInfoMayBeAsked) {
  writeCompressed();
  sensor_msgs::CompressedImage later = compressedOf(2);
  later.header.stamp += ros::Duration(0.5);
  bag_.write(kCompressedTopic, later.header.stamp, later);
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = ros::Time(200.0);
  transform.header.frame_id = "map";
  transform.child_frame_id = "camera";
  transform.transform.rotation.w = 1.0;
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform);
  bag_.write("/tf", ros::Time(200.0), message);
  EXPECT_EQ(read().size(), 3u);
  EXPECT_EQ(source_->skipped(), (std::map<std::string, size_t>{{"no_camera_info", 1}}));
  options_.latest_camera_info = true;
  EXPECT_EQ(read().size(), 4u);
}

TEST_F(CompressedBag, DamagedImagesAreCounted) {
  writeCompressed();
  sensor_msgs::CompressedImage damaged = compressedOf(1);
  damaged.data.resize(20);
  bag_.write(kCompressedTopic, headerOf(1).stamp, damaged);
  damaged.data.clear();
  bag_.write(kCompressedTopic, headerOf(2).stamp, damaged);
  EXPECT_EQ(read().size(), static_cast<size_t>(kFrames));
  EXPECT_EQ(source_->skipped(), (std::map<std::string, size_t>{{"bad_image", 2}}));
}

}  // namespace
}  // namespace dtsdf
