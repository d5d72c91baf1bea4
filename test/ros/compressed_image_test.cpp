#include "ros/input/image_kind.h"

#include <gtest/gtest.h>

#include <boost/make_shared.hpp>

#include "ros/input/images.h"
#include "support/compressed_depth.h"

namespace dtsdf {
namespace {

sensor_msgs::CompressedImage makeMessage(const std::string& encoding) {
  sensor_msgs::CompressedImage message;
  message.header.stamp = ros::Time(5.0);
  message.header.frame_id = "camera";
  message.format = encoding + "; compressedDepth rvl";
  message.data = compressRvl({0, 100, 200, 300, 400, 65535}, 3, compressedHeader(50.0f, 0.0f));
  return message;
}

TEST(CompressedImage, BecomesTheImageThatWasSent) {
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
  EXPECT_FALSE(checkDepthImage(*image, info));
  cv_bridge::CvImageConstPtr pixels;
  const DepthFrame frame = makeDepthFrame(image, info, {}, pixels);
  EXPECT_EQ(static_cast<const uint16_t*>(frame.data)[4], 400);
}

TEST(CompressedImage, IsKnownByItsFormat) {
  EXPECT_TRUE(holdsDepth(makeMessage("16UC1")));
  EXPECT_FALSE(holdsDepth(makeMessage("bgr8")));
  sensor_msgs::CompressedImage colour;
  colour.format = "bgr8; jpeg compressed bgr8";
  EXPECT_FALSE(holdsDepth(colour));
  EXPECT_THROW(decodeDepth(colour), std::runtime_error);
}

}  // namespace
}  // namespace dtsdf
