#include "ros/input/images.h"

#include <gtest/gtest.h>

#include <boost/make_shared.hpp>

#include <cstring>
#include <limits>

#include "support/compressed_depth.h"

namespace dtsdf {
namespace {

sensor_msgs::CameraInfo depthInfo() {
  sensor_msgs::CameraInfo info;
  info.width = 3;
  info.height = 2;
  info.K = {100.0, 0.0, 1.0, 0.0, 110.0, 0.5, 0.0, 0.0, 1.0};
  info.P = {200.0, 0.0, 1.5, 0.0, 0.0, 210.0, 0.75, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

/// 3 x 2 pixels with the values 1000 to 1005 and `padding` bytes after each row.
sensor_msgs::Image makeImage(bool big_endian = false, uint32_t padding = 0) {
  sensor_msgs::Image image;
  image.header.stamp = ros::Time(1.0);
  image.width = 3;
  image.height = 2;
  image.encoding = "16UC1";
  image.is_bigendian = big_endian;
  image.step = 6 + padding;
  image.data.assign(2 * image.step, 0xee);
  for (uint32_t i = 0; i < 6; ++i) {
    const uint16_t value = static_cast<uint16_t>(1000 + i);
    uint8_t* pixel = &image.data[i / 3 * image.step + i % 3 * 2];
    pixel[big_endian ? 1 : 0] = static_cast<uint8_t>(value & 0xff);
    pixel[big_endian ? 0 : 1] = static_cast<uint8_t>(value >> 8);
  }
  return image;
}

sensor_msgs::ImageConstPtr share(const sensor_msgs::Image& image) {
  return boost::make_shared<const sensor_msgs::Image>(image);
}

std::vector<uint16_t> pixelsOf(const DepthFrame& frame) {
  std::vector<uint16_t> pixels(6);
  for (size_t i = 0; i < 6; ++i) {
    const auto* row = static_cast<const uint8_t*>(frame.data) + i / 3 * frame.row_bytes;
    std::memcpy(&pixels[i], row + i % 3 * 2, 2);
  }
  return pixels;
}

const std::vector<uint16_t> kPixels{1000, 1001, 1002, 1003, 1004, 1005};

std::optional<Rejection> check(const sensor_msgs::Image& image,
                               const sensor_msgs::CameraInfo& info) {
  return checkDepthImage({share(image), boost::make_shared<sensor_msgs::CameraInfo>(info)});
}

DropReason depthReason(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info) {
  const auto rejection = check(image, info);
  EXPECT_TRUE(rejection.has_value());
  return rejection ? rejection->reason : drop::kPaused;
}

TEST(DepthImage, AcceptsEitherByteOrderAndPadding) {
  for (const bool big_endian : {false, true}) {
    for (const uint32_t padding : {0u, 2u}) {
      const sensor_msgs::Image image = makeImage(big_endian, padding);
      ASSERT_FALSE(check(image, depthInfo())) << big_endian << " " << padding;
      cv_bridge::CvImageConstPtr pixels;
      EXPECT_EQ(pixelsOf(makeDepthFrame(share(image), depthInfo(), pixels)), kPixels)
          << big_endian << " " << padding;
    }
  }
}

TEST(DepthImage, IsNotCopiedUnnecessarily) {
  const sensor_msgs::ImageConstPtr image = share(makeImage(false, 2));
  cv_bridge::CvImageConstPtr pixels;
  const DepthFrame frame = makeDepthFrame(image, depthInfo(), pixels);
  EXPECT_EQ(frame.data, image->data.data());
  EXPECT_EQ(frame.row_bytes, 8u);
}

TEST(DepthImage, TruncatedDataAndMisalignedRowsThrow) {
  for (const uint32_t padding : {2u, 3u}) {
    sensor_msgs::Image image = makeImage(false, padding);
    if (padding == 2) image.data.resize(image.data.size() - 2);
    cv_bridge::CvImageConstPtr pixels;
    EXPECT_THROW(makeDepthFrame(share(image), depthInfo(), pixels), std::exception);
  }
}

TEST(DepthImage, AcceptsMono16) {
  for (const bool big_endian : {false, true}) {
    sensor_msgs::Image image = makeImage(big_endian, 2);
    image.encoding = "mono16";
    ASSERT_FALSE(check(image, depthInfo()));
    cv_bridge::CvImageConstPtr pixels;
    const DepthFrame frame = makeDepthFrame(share(image), depthInfo(), pixels);
    EXPECT_EQ(frame.encoding, DepthEncoding::kUint16);
    EXPECT_EQ(pixelsOf(frame), kPixels);
  }
}

TEST(DepthImage, BigEndianFloatsAreSwapped) {
  const float depth_m = 1.25f;
  sensor_msgs::Image image = makeImage(true);
  image.encoding = "32FC1";
  image.step = 12;
  image.data.resize(24);
  for (size_t i = 0; i < 24; ++i) {
    image.data[i] = reinterpret_cast<const uint8_t*>(&depth_m)[3 - i % 4];
  }
  cv_bridge::CvImageConstPtr pixels;
  const DepthFrame frame = makeDepthFrame(share(image), depthInfo(), pixels);
  EXPECT_EQ(frame.row_bytes, 12u);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(static_cast<const float*>(frame.data)[i], depth_m);
}

TEST(DepthImage, UnitDependsOnTheEncoding) {
  cv_bridge::CvImageConstPtr pixels;
  sensor_msgs::Image image = makeImage();
  EXPECT_FLOAT_EQ(makeDepthFrame(share(image), depthInfo(), pixels, 0.0002f).unit_m, 0.0002f);
  image.encoding = "32FC1";
  image.step = 12;
  image.data.assign(24, 0);
  const DepthFrame frame = makeDepthFrame(share(image), depthInfo(), pixels, 0.0002f);
  EXPECT_FLOAT_EQ(frame.unit_m, 1.0f);
  EXPECT_EQ(frame.encoding, DepthEncoding::kFloat32);
}

TEST(DepthImage, InvalidImagesAreRefused) {
  const sensor_msgs::CameraInfo info = depthInfo();
  sensor_msgs::Image image = makeImage();
  image.encoding = "bgr8";
  EXPECT_EQ(depthReason(image, info), drop::kBadEncoding);

  image = makeImage();
  image.data.pop_back();
  EXPECT_EQ(depthReason(image, info), drop::kBadImage);
  image = makeImage();
  image.step = 5;
  EXPECT_EQ(depthReason(image, info), drop::kBadImage);
  image = makeImage();
  image.width = 0;
  EXPECT_EQ(depthReason(image, info), drop::kBadImage);
  image = makeImage();
  image.width = image.height = 0x80000000u;  // 2 * width overflows to 0 in 32 bits
  image.step = 0;
  EXPECT_EQ(depthReason(image, info), drop::kBadImage);
  image = makeImage();
  image.height = 0x40000000u;
  EXPECT_EQ(depthReason(image, info), drop::kBadImage);
  image = makeImage();
  image.height = 0;
  EXPECT_EQ(depthReason(image, info), drop::kBadImage);

  image = makeImage();
  image.header.stamp = ros::Time();
  EXPECT_EQ(depthReason(image, info), drop::kNoStamp);
}

TEST(DepthImage, UnusableCameraInfoIsRefused) {
  sensor_msgs::CameraInfo info = depthInfo();
  info.width = 4;
  EXPECT_EQ(depthReason(makeImage(), info), drop::kSizeMismatch);
  info = depthInfo();
  info.P[0] = info.K[0] = 0.0;
  EXPECT_EQ(depthReason(makeImage(), info), drop::kBadIntrinsics);
  info = depthInfo();
  info.P[6] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(depthReason(makeImage(), info), drop::kBadIntrinsics);
  info = depthInfo();
  info.D = {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(depthReason(makeImage(), info), drop::kBadIntrinsics);
}

TEST(Intrinsics, AreThoseOfTheRectifiedImage) {
  EXPECT_FLOAT_EQ(intrinsicsOf(depthInfo()).fx, 200.0f);
  EXPECT_FLOAT_EQ(intrinsicsOf(depthInfo()).cy, 0.75f);
  sensor_msgs::CameraInfo info = depthInfo();
  info.P.fill(0.0);
  EXPECT_FLOAT_EQ(intrinsicsOf(info).fx, 100.0f);
  EXPECT_FLOAT_EQ(intrinsicsOf(info).fy, 110.0f);
  EXPECT_FLOAT_EQ(intrinsicsOf(info).cx, 1.0f);
}

TEST(Intrinsics, FollowBinningAndRegionOfInterest) {
  sensor_msgs::CameraInfo info = depthInfo();
  info.width = 16;
  info.height = 16;
  info.roi.width = 6;
  info.roi.height = 4;
  info.roi.x_offset = 1;
  info.binning_x = 2;
  info.binning_y = 2;
  EXPECT_FALSE(check(makeImage(), info));
  EXPECT_FLOAT_EQ(intrinsicsOf(info).fx, 100.0f);
  EXPECT_FLOAT_EQ(intrinsicsOf(info).cx, 0.25f);
}

TEST(ImageArrival, OversizedImagesAreRefused) {
  sensor_msgs::Image image = makeImage();
  EXPECT_FALSE(checkArrival(image, 1000));
  EXPECT_EQ(checkArrival(image, 10).value().reason, drop::kTooLarge);
  image.width = 8192;
  image.height = 1024;
  EXPECT_FALSE(checkArrival(image, 1000)) << "2^23 pixels should be accepted";
  image.height = 1025;
  EXPECT_EQ(checkArrival(image, 1000).value().reason, drop::kTooLarge);
  image.width = image.height = 0xffffffffu;
  EXPECT_EQ(checkArrival(image, 1000).value().reason, drop::kTooLarge);
  image.height = 0;
  EXPECT_FALSE(checkArrival(image, 1000)) << "checkDepthImage() should report empty images";
}

sensor_msgs::CompressedImage makeMessage(const std::string& encoding) {
  sensor_msgs::CompressedImage message;
  message.header.stamp = ros::Time(5.0);
  message.header.frame_id = "camera";
  message.format = encoding + "; compressedDepth rvl";
  message.data = compressRvl({0, 100, 200, 300, 400, 65535}, 3, compressedHeader(50.0f, 0.0f));
  return message;
}

TEST(CompressedImage, DecodesToTheOriginalImage) {
  const sensor_msgs::ImageConstPtr image = decodeDepth(makeMessage("16UC1"));
  EXPECT_EQ(image->header.stamp, ros::Time(5.0));
  EXPECT_EQ(image->header.frame_id, "camera");
  EXPECT_EQ(image->encoding, "16UC1");
  EXPECT_EQ(image->width, 3u);
  EXPECT_EQ(image->height, 2u);
  EXPECT_EQ(image->step, 6u);

  sensor_msgs::CameraInfo info;
  info.width = 3;
  info.height = 2;
  info.K = {100.0, 0.0, 1.0, 0.0, 100.0, 0.5, 0.0, 0.0, 1.0};
  EXPECT_FALSE(check(*image, info));
  cv_bridge::CvImageConstPtr pixels;
  const DepthFrame frame = makeDepthFrame(image, info, pixels);
  EXPECT_EQ(static_cast<const uint16_t*>(frame.data)[4], 400);
}

TEST(CompressedImage, IsRecognisedByItsFormat) {
  EXPECT_TRUE(holdsDepth(makeMessage("16UC1")));
  EXPECT_FALSE(holdsDepth(makeMessage("bgr8")));
  sensor_msgs::CompressedImage colour;
  colour.format = "bgr8; jpeg compressed bgr8";
  EXPECT_FALSE(holdsDepth(colour));
  EXPECT_THROW(decodeDepth(colour), std::runtime_error);
}

}  // namespace
}  // namespace dtsdf
