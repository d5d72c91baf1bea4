/// Tests reading depth, clouds, masks, colour and IMU data from bags.
#include "io/bag_frames.h"

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Imu.h>

#include <cmath>

#include "ros/support/cloud.h"
#include "ros/support/messages.h"
#include "support/compressed_depth.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 8, kHeight = 6, kFrames = 3;
const std::string kTopic = "/camera/depth/image_rect";
const std::string kCompressedTopic = kTopic + "/compressedDepth";

std_msgs::Header headerOf(int i) { return makeHeader(ros::Time(100.0 + i), "camera"); }

/// The transform of `frame` in the map: shifted by `x`, not rotated.
tf2_msgs::TFMessage shiftOf(const std::string& frame, double x, const ros::Time& stamp) {
  return makeTfMessage("map", frame, Eigen::Isometry3d(Eigen::Translation3d(x, 0.0, 0.0)), stamp);
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
  return makeImageMessage(headerOf(i), "16UC1", kWidth, kHeight,
                          std::vector<uint8_t>(depth.datastart, depth.dataend));
}

/// Depth image `i`, alternately as PNG and as RVL.
sensor_msgs::CompressedImage compressedOf(int i) {
  const cv::Mat depth = depthOf(i);
  sensor_msgs::CompressedImage image;
  image.header = headerOf(i);
  image.format = i % 2 == 0 ? "16UC1; compressedDepth" : "16UC1; compressedDepth rvl";
  image.data = i % 2 == 0 ? compressPng(depth)
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
    sensor_msgs::CameraInfo info = makeCameraInfo(rawOf(i), {10.0f, 10.0f, 3.5f, 2.5f});
    info.D = {0.9, 0.0, 0.0, 0.0, 0.0};  // must be ignored, because the images are rectified
    bag_.write("/camera/depth/camera_info", stamp, info);
    bag_.write("/tf", stamp, shiftOf("camera", 0.0, stamp));
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

TEST_F(CompressedBag, DecodesToTheOriginalImages) {
  writeCompressed();
  expectFrames(read());
  EXPECT_TRUE(source_->skipped().empty());
}

TEST_F(CompressedBag, ImagesWithARepeatedStampAreSkipped) {
  for (const int i : {0, 1, 1, 2}) bag_.write(kTopic, headerOf(i).stamp, rawOf(i));
  expectFrames(read());
  EXPECT_EQ(source_->skipped().at("repeated_stamp"), 1u);
}

TEST_F(CompressedBag, ImagesOnBothTopicsAreReadOnce) {
  writeCompressed();
  for (int i = 0; i < kFrames; ++i) bag_.write(kTopic, headerOf(i).stamp, rawOf(i));
  expectFrames(read());
}

TEST_F(CompressedBag, TopicMayIncludeTheTransport) {
  writeCompressed();
  options_.depth_topic = kTopic;
  expectFrames(read());
  options_.depth_topic = kCompressedTopic;
  expectFrames(read());
}

/// Without depth images, clouds are read instead; they need no camera_info.
TEST_F(CompressedBag, CloudsAreReadAsDepth) {
  constexpr int kWide = 32, kHigh = 24;
  const Intrinsics K{30.0f, 31.0f, 15.5f, 11.5f};
  std::vector<float> depth_m;
  for (int p = 0; p < kWide * kHigh; ++p) depth_m.push_back(1.0f + 0.01f * static_cast<float>(p));
  for (int i = 0; i < kFrames; ++i) {
    bag_.write("/lidar/points", headerOf(i).stamp,
               makeCloud(headerOf(i), K, kWide * kHigh, 1, depth_m));
    bag_.write("/kinect/points", headerOf(i).stamp,
               makeCloud(headerOf(i), K, kWide, kHigh, depth_m));
  }
  const std::vector<SourceFrame> frames = read();
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  EXPECT_EQ(std::memcmp(frames[2].depth.data, depth_m.data(), 4 * depth_m.size()), 0);
  EXPECT_NEAR(frames[2].depth.intrinsics.fy, 31.0, 1e-4);
  options_.input.depth_along_ray = true;  // does not apply to clouds
  EXPECT_EQ(std::memcmp(read()[2].depth.data, depth_m.data(), 4 * depth_m.size()), 0);
  options_.intrinsics = Intrinsics{33.0f, 34.0f, 15.0f, 11.0f};
  EXPECT_EQ(read().at(0).depth.intrinsics.fx, 33.0f);
  options_.depth_topic = "/lidar/points";
  EXPECT_TRUE(read().empty());
  EXPECT_EQ(source_->skipped().at("unorganised"), static_cast<size_t>(kFrames));
}

/// Errors about wrong names list the names in the bag.
TEST_F(CompressedBag, ErrorsListTheAvailableNames) {
  writeCompressed();
  const auto error = [&] { return errorOf([&] { read(); }); };
  options_.depth_topic = "/depth";
  EXPECT_NE(error().find("'" + kCompressedTopic + "' (sensor_msgs/CompressedImage)"),
            std::string::npos)
      << error();
  options_.depth_topic.clear();
  options_.map_frame = "odom";
  EXPECT_NE(error().find("TF contains 'camera', 'map'"), std::string::npos) << error();
}

/// Errors about missing inputs name the option that helps, and each reason for skipping images
/// comes with a message.
TEST_F(CompressedBag, ErrorsNameTheOptionThatHelps) {
  const auto error = [&] { return errorOf([&] { read(); }); };
  bag_.write("/d64", headerOf(0).stamp,
             makeImageMessage(headerOf(0), "64FC1", 2, 1, std::vector<uint8_t>(16)));
  EXPECT_NE(error().find("'/d64' (sensor_msgs/Image)"), std::string::npos) << error();
  options_.depth_topic = "/d64";
  EXPECT_NE(error().find("--info-topic"), std::string::npos) << error();
  options_.info_topic = "/camera/depth/camera_info";
  EXPECT_TRUE(read().empty());
  EXPECT_NE(source_->problems().at("bad_encoding").find("'64FC1'"), std::string::npos);
}

TEST_F(CompressedBag, SixteenBitDepthMayUseTheCompressedTransport) {
  for (int i = 0; i < kFrames; ++i) {
    sensor_msgs::CompressedImage image = compressedOf(i);
    image.format = "16UC1; png compressed ";
    image.data = compressPng(depthOf(i), {});
    bag_.write(kTopic + "/compressed", image.header.stamp, image);
  }
  expectFrames(read());
}

TEST_F(CompressedBag, TransformsMayBeOnAnotherTopic) {
  options_.path = folder_ / "b.bag";
  rosbag::Bag bag(options_.path, rosbag::bagmode::Write);
  bag.write("/camera/depth/camera_info", headerOf(0).stamp,
            makeCameraInfo(rawOf(0), {10.0f, 10.0f, 3.5f, 2.5f}));
  bag.write(kTopic, headerOf(0).stamp, rawOf(0));
  bag.write("/poses", headerOf(0).stamp, shiftOf("robot", 0.0, headerOf(0).stamp));
  bag.write("/poses_static", headerOf(1).stamp,
            makeTfMessage("robot", "camera", Eigen::Isometry3d::Identity(), headerOf(1).stamp));
  bag.close();
  const std::string error = errorOf([&] { openBagFrames(options_)->next(); });
  EXPECT_NE(error.find("'/poses_static' (tf2_msgs/TFMessage); give --tf-topic"), std::string::npos)
      << error;
  options_.tf_topic = "/poses";
  EXPECT_TRUE(openBagFrames(options_)->next());
}

TEST_F(CompressedBag, MasksRemoveMeasurements) {
  writeCompressed();
  for (int i = 0; i < 2; ++i) {  // the last image has no mask
    const int height = i == 0 ? kHeight : kHeight + 1;
    std::vector<uint8_t> mask(static_cast<size_t>(kWidth * height), 0);
    mask[9] = 255;
    bag_.write("/mask", headerOf(i).stamp + ros::Duration(0.3),
               makeImageMessage(headerOf(i), "mono8", kWidth, height, mask));
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

TEST_F(CompressedBag, ImagesAreRectifiedOnRequest) {
  writeCompressed();
  options_.input.rectify = Usage::kAlways;
  const std::vector<SourceFrame> frames = read();
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  const DepthFrame& depth = frames[1].depth;
  EXPECT_EQ(depth.intrinsics.fx, 10.0f);
  EXPECT_NE(std::memcmp(depth.data, depthOf(1).data, 2 * kWidth * kHeight), 0);
  const auto* pixels = static_cast<const uint16_t*>(depth.data);
  EXPECT_EQ(pixels[2 * kWidth + 3], depthOf(1).at<uint16_t>(2, 3))
      << "the middle pixel must not change";
}

TEST_F(CompressedBag, LatestCameraInfoMayBeRequested) {
  writeCompressed();
  sensor_msgs::CompressedImage later = compressedOf(2);
  later.header.stamp += ros::Duration(0.5);
  bag_.write(kCompressedTopic, later.header.stamp, later);
  bag_.write("/tf", ros::Time(200.0), shiftOf("camera", 0.0, ros::Time(200.0)));
  EXPECT_EQ(read().size(), 3u);
  EXPECT_EQ(source_->skipped(), (std::map<std::string, size_t>{{"no_camera_info", 1}}));
  options_.input.latest_camera_info = true;
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

/// Adds colour images of a camera with its own frame. The colour images of CompressedBag are empty.
class ColourBag : public CompressedBag {
 protected:
  void SetUp() override {
    CompressedBag::SetUp();
    options_.colour_topic = "/color/image_rect";
  }

  static sensor_msgs::Image imageAt(double stamp_s, const std::string& encoding) {
    const cv::Mat bgr = pixels();
    return makeImageMessage(makeHeader(ros::Time(stamp_s), "color"), encoding, 10, 4,
                            std::vector<uint8_t>(bgr.datastart, bgr.dataend));
  }

  void writeCameraOf(double stamp_s) {
    const ros::Time stamp(stamp_s);
    bag_.write("/color/camera_info", stamp,
               makeCameraInfo(imageAt(stamp_s, "bgr8"), {20.0f, 21.0f, 4.5f, 1.5f}));
    bag_.write("/tf", stamp, shiftOf("color", stamp_s, stamp));
  }

  static cv::Mat pixels() { return cv::Mat(4, 10, CV_8UC3, cv::Scalar(30, 20, 10)); }

  /// `recorded` is the time at which the bag received the image.
  void writeRaw(double stamp_s, const ros::Time& recorded, const std::string& encoding = "bgr8") {
    bag_.write("/color/image_rect", recorded, imageAt(stamp_s, encoding));
  }

  std::vector<SourceColour> readColours() {
    bag_.close();
    colours_ = openBagColours(options_);
    std::vector<SourceColour> images;
    while (auto image = colours_->next()) images.push_back(std::move(*image));
    return images;
  }

  std::unique_ptr<ColourSource> colours_;
};

TEST_F(ColourBag, IsReadInStampOrderWithItsOwnPoses) {
  for (const double stamp_s : {100.2, 100.4, 100.6}) writeCameraOf(stamp_s);
  writeRaw(100.6, ros::Time(101.0));
  writeRaw(100.2, ros::Time(101.5));
  writeRaw(100.4, ros::Time(101.5));
  writeRaw(100.4, ros::Time(102.0), "32FC1");
  writeRaw(100.3, ros::Time(102.5));  // without camera_info
  const std::vector<SourceColour> images = readColours();
  ASSERT_EQ(images.size(), 3u);
  EXPECT_EQ(images[0].stamp_s, 100.2);
  EXPECT_EQ(images[1].stamp_s, 100.4);
  EXPECT_EQ(images[2].stamp_s, 100.6);
  const ColourFrame& image = images[1].colour;
  EXPECT_EQ(image.T_W_C.translation().x(), 100.4);
  EXPECT_EQ(image.intrinsics.fy, 21.0f);
  EXPECT_EQ(image.encoding, ColourEncoding::kBgr8);
  EXPECT_EQ(static_cast<const uint8_t*>(image.data)[0], 30);
  EXPECT_EQ(colours_->skipped(),
            (std::map<std::string, size_t>{{"colour images: bad_encoding", 1},
                                           {"colour images: no_camera_info", 1}}));
}

TEST_F(ColourBag, YieldsOnlyListedImages) {
  for (const double stamp_s : {100.2, 100.4, 100.6}) writeCameraOf(stamp_s);
  for (const double stamp_s : {100.6, 100.3, 100.2, 100.4}) {  // 100.3 has no camera_info
    writeRaw(stamp_s, ros::Time(101.0 + stamp_s));
  }
  options_.listed_colours =
      std::make_shared<const std::vector<size_t>>(std::vector<size_t>{1, 2, 3});
  const std::vector<SourceColour> images = readColours();
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(images[0].index, 2u);
  EXPECT_EQ(images[0].stamp_s, 100.4);
  EXPECT_EQ(images[1].index, 3u);
}

TEST_F(ColourBag, ImagesMayBeCompressed) {
  for (const double stamp_s : {100.2, 100.4}) {
    writeCameraOf(stamp_s);
    sensor_msgs::CompressedImage image;
    image.header = makeHeader(ros::Time(stamp_s), "color");
    image.format = "bgr8; png compressed bgr8";
    cv::imencode(".png", pixels(), image.data);
    if (stamp_s > 100.3) image.data.resize(20);
    bag_.write("/color/image_rect/compressed", image.header.stamp, image);
  }
  const std::vector<SourceColour> images = readColours();
  ASSERT_EQ(images.size(), 1u);
  EXPECT_EQ(images[0].colour.encoding, ColourEncoding::kRgb8);
  EXPECT_EQ(static_cast<const uint8_t*>(images[0].colour.data)[0], 10);
  EXPECT_EQ(colours_->skipped().at("colour images: bad_image"), 1u);
}

TEST_F(ColourBag, TopicIsFoundIfItIsTheOnlyOne) {
  options_.colour_topic.clear();
  EXPECT_TRUE(readColours().empty());
  EXPECT_EQ(colours_->skipped(),  // the images on the only topic are empty
            (std::map<std::string, size_t>{{"colour images: bad_image", kFrames}}));
  bag_.open(options_.path, rosbag::bagmode::Append);
  writeCameraOf(100.2);
  writeRaw(100.2, ros::Time(100.2));
  bag_.close();
  EXPECT_EQ(openBagColours(options_), nullptr) << "two topics are ambiguous";
  options_.colour_topic = "/no/such/topic";
  EXPECT_THROW(openBagColours(options_), std::runtime_error);
}

/// An IMU rotated by 90 degrees about z: its y axis, which points up, is -x of the map.
class InertialBag : public testing::Test {
 protected:
  InertialBag() {
    options_.path = folder_ / "imu.bag";
    bag_.open(options_.path, rosbag::bagmode::Write);
  }

  static ros::Time stampOf(int i) { return ros::Time(100.0 + 0.01 * i); }

  void writeImu(const std::string& topic, int first, int last, double shake) {
    for (int i = first; i < last; ++i) {
      sensor_msgs::Imu imu;
      imu.header.stamp = stampOf(i);
      imu.header.frame_id = "imu";
      imu.linear_acceleration.y = 9.8;
      imu.linear_acceleration.x = i % 2 == 0 ? shake : -shake;
      bag_.write(topic, imu.header.stamp, imu);
    }
  }

  void writeTransform() {
    const Eigen::Isometry3d T(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
    for (const int i : {0, 1000}) {
      bag_.write("/tf", stampOf(i), makeTfMessage("map", "imu", T, stampOf(i)));
    }
  }

  std::string error() {
    bag_.close();
    return errorOf([&] { findUpInBag(options_); });
  }

  bool errorHas(const std::string& part) { return error().find(part) != std::string::npos; }

  TemporaryFolder folder_;
  BagOptions options_;
  rosbag::Bag bag_;
};

TEST_F(InertialBag, GivesTheUpDirection) {
  writeImu("/imu", 0, 200, 3.0);
  writeImu("/imu", 200, 400, 0.05);
  writeTransform();
  bag_.close();
  EXPECT_LT((findUpInBag(options_) + Eigen::Vector3d::UnitX()).norm(), 0.002);
  options_.imu_topic = "/other";
  EXPECT_TRUE(errorHas("has no messages on '/other'"));
}

TEST_F(InertialBag, FailsWithoutAnImu) {
  writeTransform();
  EXPECT_TRUE(errorHas("no topic with IMU messages"));
}

TEST_F(InertialBag, FailsIfNeverAtRest) {
  writeImu("/imu", 0, 400, 3.0);
  writeTransform();
  EXPECT_TRUE(errorHas("never at rest"));
}

TEST_F(InertialBag, FailsWithoutTransform) {
  writeImu("/imu", 0, 400, 0.0);
  EXPECT_TRUE(errorHas("has no transform to 'map'"));
}

TEST_F(InertialBag, OneOfSeveralTopicsMustBeNamed) {
  writeImu("/accel", 0, 400, 0.0);
  writeImu("/gyro", 0, 400, 0.0);
  writeTransform();
  EXPECT_TRUE(errorHas("'/accel' (sensor_msgs/Imu), '/gyro' (sensor_msgs/Imu)"));
  options_.imu_topic = "/accel";
  EXPECT_EQ(error(), "");
  options_.poses_path = "slam.tum";
  EXPECT_TRUE(errorHas("leave --poses out"));
}

}  // namespace
}  // namespace dtsdf
