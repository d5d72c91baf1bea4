#include "ros/input/clouds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ros/support/cloud.h"
#include "ros/support/messages.h"
#include "simulation/scene.h"

namespace dtsdf {
namespace {

constexpr int kCloudWidth = 64, kCloudHeight = 48;
constexpr size_t kEnoughBytes = 1 << 20;
constexpr Intrinsics kCloudCamera{60.0f, 61.0f, 31.25f, 22.5f};

std::vector<float> depthOfRoom() {
  std::vector<float> depth_m =
      renderDepth(makeRoomScene(), kCloudCamera, kCloudWidth, kCloudHeight, roomCameraPose(1.0));
  depth_m[100] = 0.0f;
  return depth_m;
}

sensor_msgs::PointCloud2 cloudOfRoom(const CloudLayout& layout = {}) {
  return makeCloud(makeHeader(ros::Time(1.0), "camera"), kCloudCamera, kCloudWidth, kCloudHeight,
                   depthOfRoom(), layout);
}

std::vector<float> depthIn(const sensor_msgs::Image& image) {
  std::vector<float> depth_m(image.data.size() / sizeof(float));
  std::memcpy(depth_m.data(), image.data.data(), image.data.size());
  for (float& depth : depth_m) {
    if (std::isnan(depth)) depth = 0.0f;
  }
  return depth_m;
}

DropReason rejectionReason(const sensor_msgs::PointCloud2& cloud, bool has_info = false) {
  CloudImages images("/points");
  const auto converted = images.convert(cloud, has_info, kEnoughBytes);
  const auto* const rejection = std::get_if<Rejection>(&converted);
  EXPECT_NE(rejection, nullptr);
  return rejection == nullptr ? drop::kPaused : rejection->reason;
}

TEST(Clouds, AreReadInEveryLayout) {
  using sensor_msgs::PointField;
  for (const uint8_t datatype : {PointField::FLOAT32, PointField::FLOAT64}) {
    for (const std::string names : {"xyz", "izyx"}) {
      CloudImages images("/points");
      const auto converted =
          images.convert(cloudOfRoom({datatype, names, 12}), false, kEnoughBytes);
      ASSERT_TRUE(std::holds_alternative<CameraImage>(converted));
      const auto& [image, info, mask] = std::get<CameraImage>(converted);
      EXPECT_EQ(depthIn(*image), depthOfRoom()) << names;
      EXPECT_FALSE(checkDepthImage({image, info}));
    }
  }
}

/// Rounding errors in the points make the computed intrinsics inexact.
TEST(Clouds, YieldTheIntrinsicsOfTheirCamera) {
  CloudImages images("/points");
  const auto converted = images.convert(cloudOfRoom(), false, kEnoughBytes);
  const Intrinsics K = intrinsicsOf(*std::get<CameraImage>(converted).info);
  EXPECT_NEAR(K.fx, kCloudCamera.fx, 1e-4);
  EXPECT_NEAR(K.fy, kCloudCamera.fy, 1e-4);
  EXPECT_NEAR(K.cx, kCloudCamera.cx, 1e-4);
  EXPECT_NEAR(K.cy, kCloudCamera.cy, 1e-4);
  EXPECT_EQ(images.camera().rfind("64 x 48, fx 60, fy 61, cx 31.25, cy 22.5, ", 0), 0u)
      << images.camera();
  // The intrinsics are kept until the size of the clouds changes.
  sensor_msgs::PointCloud2 few = cloudOfRoom();
  std::fill(few.data.begin(), few.data.begin() + 40 * few.row_step, 0xff);  // NaN
  EXPECT_TRUE(std::holds_alternative<CameraImage>(images.convert(few, false, kEnoughBytes)));
  few.height = 47;
  EXPECT_TRUE(std::holds_alternative<Rejection>(images.convert(few, false, kEnoughBytes)));
}

TEST(Clouds, AreRefusedIfUnusable) {
  sensor_msgs::PointCloud2 cloud = cloudOfRoom();
  cloud.width *= cloud.height;
  cloud.height = 1;
  EXPECT_EQ(rejectionReason(cloud), drop::kUnorganised);
  EXPECT_EQ(rejectionReason(cloudOfRoom({sensor_msgs::PointField::UINT32})), drop::kBadEncoding);
  EXPECT_EQ(rejectionReason(cloudOfRoom({sensor_msgs::PointField::FLOAT32, "xyi"})),
            drop::kBadEncoding);
  cloud = cloudOfRoom();
  cloud.is_bigendian = 1;
  EXPECT_EQ(rejectionReason(cloud), drop::kBadEncoding);
  cloud = cloudOfRoom();
  cloud.fields[2].offset = 0xfffffffe;
  EXPECT_EQ(rejectionReason(cloud), drop::kBadEncoding);
  for (uint32_t sensor_msgs::PointCloud2::*const member :
       {&sensor_msgs::PointCloud2::width, &sensor_msgs::PointCloud2::height,
        &sensor_msgs::PointCloud2::row_step, &sensor_msgs::PointCloud2::point_step}) {
    cloud = cloudOfRoom();
    cloud.*member = 0xffffffff;
    EXPECT_EQ(rejectionReason(cloud), drop::kBadImage);
    EXPECT_EQ(rejectionReason(cloud, true), drop::kBadImage);
  }
  cloud = cloudOfRoom();
  std::fill(cloud.data.begin(), cloud.data.end(), 0xff);
  EXPECT_EQ(rejectionReason(cloud), drop::kNoMeasurement);
  cloud = cloudOfRoom({sensor_msgs::PointField::FLOAT32, "xyz", 0});  // mirrored, so x points left
  for (size_t at = cloud.fields[0].offset; at < cloud.data.size(); at += cloud.point_step) {
    cloud.data[at + 3] ^= 0x80;
  }
  EXPECT_EQ(rejectionReason(cloud), drop::kBadIntrinsics);
}

/// A cloud from a spinning lidar with 48 rings, in the lidar's frame (x forward, z up).
TEST(Clouds, FromALidarAreRefused) {
  sensor_msgs::PointCloud2 cloud = cloudOfRoom();
  for (int v = 0; v < kCloudHeight; ++v) {
    for (int u = 0; u < kCloudWidth; ++u) {
      const double turn = 2.0 * M_PI * u / kCloudWidth, rise = 0.8 * v / kCloudHeight - 0.4;
      const float point[] = {static_cast<float>(3.0 * std::cos(turn) * std::cos(rise)),
                             static_cast<float>(3.0 * std::sin(turn) * std::cos(rise)),
                             static_cast<float>(3.0 * std::sin(rise))};
      std::memcpy(&cloud.data[static_cast<size_t>(v) * cloud.row_step +
                              static_cast<size_t>(u) * cloud.point_step + 4],
                  point, sizeof(point));
    }
  }
  EXPECT_EQ(rejectionReason(cloud), drop::kBadIntrinsics);
  EXPECT_EQ(rejectionReason(cloud, true), drop::kBadIntrinsics);
}

}  // namespace
}  // namespace dtsdf
