#include "ros/input/images.h"

#include <gtest/gtest.h>
#include <sensor_msgs/CompressedImage.h>

#include <boost/make_shared.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "ros/input/rectification.h"

namespace dtsdf {
namespace {

constexpr uint32_t kWidth = 4, kHeight = 2;

sensor_msgs::CameraInfo colourInfo(uint32_t width = kWidth, uint32_t height = kHeight) {
  sensor_msgs::CameraInfo info;
  info.header.stamp = ros::Time(1.0);
  info.width = width;
  info.height = height;
  info.K = {5.0, 0.0, 1.5, 0.0, 5.0, 0.5, 0.0, 0.0, 1.0};
  info.P = {5.0, 0.0, 1.5, 0.0, 0.0, 5.0, 0.5, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

/// An image in which every pixel consists of the bytes `pixel`.
sensor_msgs::ImagePtr makeImage(const std::string& encoding, const std::vector<uint8_t>& pixel,
                                uint32_t width = kWidth, uint32_t height = kHeight) {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.stamp = ros::Time(1.0);
  image->encoding = encoding;
  image->width = width;
  image->height = height;
  image->step = width * static_cast<uint32_t>(pixel.size());
  for (uint32_t i = 0; i < width * height; ++i) {
    image->data.insert(image->data.end(), pixel.begin(), pixel.end());
  }
  return image;
}

/// RGB values of the first pixel as the mapper reads them.
std::vector<int> firstPixel(const sensor_msgs::ImageConstPtr& image) {
  const sensor_msgs::CameraInfo info = colourInfo(image->width, image->height);
  const auto rejection =
      checkColourImage({image, boost::make_shared<sensor_msgs::CameraInfo>(info)});
  EXPECT_FALSE(rejection) << image->encoding << ": " << rejection->text;
  if (rejection) return {};
  cv_bridge::CvImageConstPtr pixels;
  const ColourFrame frame = makeColourFrame(image, info, pixels);
  EXPECT_EQ(frame.width, static_cast<int>(image->width));
  EXPECT_EQ(frame.height, static_cast<int>(image->height));
  EXPECT_EQ(frame.intrinsics.fx, 5.0f);
  const auto* p = static_cast<const uint8_t*>(frame.data);
  switch (frame.encoding) {
    case ColourEncoding::kRgb8:
    case ColourEncoding::kRgba8: return {p[0], p[1], p[2]};
    case ColourEncoding::kBgr8:
    case ColourEncoding::kBgra8: return {p[2], p[1], p[0]};
    case ColourEncoding::kMono8: return {p[0], p[0], p[0]};
  }
  return {};
}

DropReason colourReason(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info) {
  const auto rejection = checkColourImage({boost::make_shared<sensor_msgs::Image>(image),
                                           boost::make_shared<sensor_msgs::CameraInfo>(info)});
  EXPECT_TRUE(rejection.has_value());
  return rejection ? rejection->reason : drop::kPaused;
}

TEST(ColourImage, SupportsTheEncodingsOfTheMapper) {
  const std::vector<int> colour{10, 20, 30};
  EXPECT_EQ(firstPixel(makeImage("rgb8", {10, 20, 30})), colour);
  EXPECT_EQ(firstPixel(makeImage("bgr8", {30, 20, 10})), colour);
  EXPECT_EQ(firstPixel(makeImage("rgba8", {10, 20, 30, 99})), colour);
  EXPECT_EQ(firstPixel(makeImage("bgra8", {30, 20, 10, 99})), colour);
  EXPECT_EQ(firstPixel(makeImage("mono8", {77})), (std::vector<int>{77, 77, 77}));
}

TEST(ColourImage, ConvertsOtherEncodings) {
  EXPECT_EQ(firstPixel(makeImage("mono16", {0, 77})), (std::vector<int>{77, 77, 77}));
  // With U = V = 128, swapped bytes would give every pixel the same luminance.
  for (const int luminance : {50, 200}) {
    const auto y = static_cast<uint8_t>(luminance);
    const std::vector<int> uyvy = firstPixel(makeImage("yuv422", {128, y}));
    const std::vector<int> yuy2 = firstPixel(makeImage("yuv422_yuy2", {y, 128}));
    EXPECT_NEAR(uyvy.at(0), (luminance - 16) * 255 / 219, 3);
    EXPECT_EQ(uyvy, yuy2);
    EXPECT_EQ(uyvy[0], uyvy[2]);
  }
}

/// Encodes a uniformly coloured image in each Bayer pattern.
TEST(ColourImage, DemosaicsBayerPatterns) {
  const auto bayer = [](const std::string& pattern, const std::vector<int>& colour, int depth) {
    const auto image =
        makeImage("bayer_" + pattern + std::to_string(depth),
                  depth == 8 ? std::vector<uint8_t>{0} : std::vector<uint8_t>{0, 0}, 8, 8);
    for (uint32_t v = 0; v < 8; ++v) {
      for (uint32_t u = 0; u < 8; ++u) {
        const char channel = pattern[2 * (v % 2) + u % 2];
        const int value = colour[channel == 'r' ? 0 : (channel == 'g' ? 1 : 2)];
        image->data[v * image->step + (depth == 8 ? u : 2 * u + 1)] = static_cast<uint8_t>(value);
      }
    }
    return firstPixel(image);
  };
  const std::vector<int> colour{200, 100, 50};
  for (const std::string pattern : {"rggb", "bggr", "gbrg", "grbg"}) {
    EXPECT_EQ(bayer(pattern, colour, 8), colour) << pattern;
    // 200 is sent as 200 * 256 out of 65535, which rounds to 199 out of 255.
    EXPECT_EQ(bayer(pattern, colour, 16), (std::vector<int>{199, 100, 50})) << pattern;
  }
}

TEST(ColourImage, InvalidImagesAreRefused) {
  EXPECT_EQ(colourReason(*makeImage("16UC1", {0, 1}), colourInfo()), drop::kBadEncoding);
  EXPECT_EQ(colourReason(*makeImage("32FC1", {0, 0, 0, 0}), colourInfo()), drop::kBadEncoding);
  EXPECT_EQ(colourReason(*makeImage("", {0, 1}), colourInfo()), drop::kBadEncoding);
  EXPECT_EQ(colourReason(*makeImage("rgb8", {1, 2}), colourInfo()), drop::kBadImage);
  EXPECT_EQ(colourReason(*makeImage("rgb8", {1, 2, 3}), colourInfo(5)), drop::kSizeMismatch);
  EXPECT_EQ(colourReason(*makeImage("yuv422", {1, 2}, 3), colourInfo(3)), drop::kBadImage);
  EXPECT_EQ(colourReason(*makeImage("rgb8", {1, 2, 3}, 0), colourInfo(0)), drop::kBadImage);
  sensor_msgs::CameraInfo uncalibrated = colourInfo();
  uncalibrated.P = {};
  uncalibrated.K = {};
  EXPECT_EQ(colourReason(*makeImage("rgb8", {1, 2, 3}), uncalibrated), drop::kBadIntrinsics);
  const auto unstamped = makeImage("rgb8", {1, 2, 3});
  unstamped->header.stamp = ros::Time();
  EXPECT_EQ(colourReason(*unstamped, colourInfo()), drop::kNoStamp);
}

TEST(ColourImage, RowsMayBePadded) {
  for (const std::string encoding : {"rgb8", "mono8", "bayer_rggb8", "yuv422"}) {
    const size_t bytes = encoding == "rgb8" ? 3 : (encoding == "yuv422" ? 2 : 1);
    const auto image = makeImage(encoding, std::vector<uint8_t>(bytes, 128), 4, 4);
    const auto padded = boost::make_shared<sensor_msgs::Image>(*image);
    padded->step = image->step + 5;
    padded->data.clear();
    for (uint32_t v = 0; v < 4; ++v) {
      const auto row = image->data.begin() + v * image->step;
      padded->data.insert(padded->data.end(), row, row + image->step);
      padded->data.insert(padded->data.end(), 5, 0);
    }
    EXPECT_EQ(firstPixel(padded), firstPixel(image)) << encoding;
  }
}

TEST(ColourImage, DistortedImagesAreRectified) {
  sensor_msgs::CameraInfo info = colourInfo();
  info.distortion_model = "plumb_bob";
  info.D = {-0.1, 0.01, 0.0, 0.0, 0.0};
  Rectification raw(Usage::kAuto, "/color/image_raw", true);
  for (const std::string encoding : {"bgr8", "mono16"}) {
    const auto image = makeImage(encoding, encoding == "bgr8" ? std::vector<uint8_t>{30, 20, 10}
                                                              : std::vector<uint8_t>{0, 20});
    const CameraImage rectified =
        raw.apply({image, boost::make_shared<const sensor_msgs::CameraInfo>(info)});
    EXPECT_NE(rectified.image, image);
    EXPECT_EQ(firstPixel(rectified.image).at(1), 20) << encoding;
  }
  EXPECT_EQ(raw.warning(), "");
}

TEST(CompressedColour, IsReadWithoutAPlugin) {
  const cv::Mat bgr(6, 8, CV_8UC3, cv::Scalar(30, 20, 10));
  for (const std::string code : {"jpg", "png"}) {
    sensor_msgs::CompressedImage message;
    message.header.stamp = ros::Time(3.0);
    message.format = code == "jpg" ? "rgb8; jpeg compressed bgr8" : "bgr8; png compressed ";
    cv::imencode("." + code, bgr, message.data);
    ASSERT_TRUE(holdsColour(message));
    const sensor_msgs::ImageConstPtr image = decodeColour(message);
    EXPECT_EQ(image->header.stamp, ros::Time(3.0));
    EXPECT_EQ(image->encoding, "rgb8");
    EXPECT_EQ(image->width, 8u);
    EXPECT_NEAR(image->data[0], 10, 2);
    EXPECT_NEAR(image->data[2], 30, 2);
    message.data.resize(message.data.size() / 2);
    EXPECT_THROW(decodeColour(message), std::runtime_error);
    message.data.clear();
    EXPECT_THROW(decodeColour(message), std::runtime_error);
  }
}

TEST(CompressedColour, IsDistinguishedFromDepthAndGrey) {
  sensor_msgs::CompressedImage message;
  for (const std::string format :
       {"16UC1; compressedDepth", "16UC1; png compressed ", "32FC1; compressedDepth png",
        "mono8; jpeg compressed mono8", "", "h264"}) {
    message.format = format;
    EXPECT_FALSE(holdsColour(message)) << format;
  }
  for (const std::string format : {"jpeg", "png", "rgb8; jpeg compressed bgr8"}) {
    message.format = format;
    EXPECT_TRUE(holdsColour(message)) << format;
  }
}

}  // namespace
}  // namespace dtsdf
