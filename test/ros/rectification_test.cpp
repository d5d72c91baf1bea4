#include "ros/input/rectification.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <boost/make_shared.hpp>
#include <cmath>
#include <cstring>

namespace dtsdf {
namespace {

constexpr int kSensorWidth = 60, kSensorHeight = 40;

/// An image in which pixel (u, v) has the value 100 + 60 v + u.
sensor_msgs::ImagePtr makeRawImage() {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->encoding = "16UC1";
  image->width = kSensorWidth;
  image->height = kSensorHeight;
  image->step = 2 * kSensorWidth;
  for (int i = 0; i < kSensorWidth * kSensorHeight; ++i) {
    image->data.push_back(static_cast<uint8_t>((100 + i) & 0xff));
    image->data.push_back(static_cast<uint8_t>((100 + i) >> 8));
  }
  return image;
}

int valueAt(const sensor_msgs::Image& image, int u, int v) {
  uint16_t value = 0;
  std::memcpy(&value, &image.data[static_cast<size_t>(v) * image.step + 2 * u], 2);
  return value;
}

sensor_msgs::CameraInfoPtr makeInfo(const std::string& model, const std::vector<double>& D) {
  const auto info = boost::make_shared<sensor_msgs::CameraInfo>();
  info->width = kSensorWidth;
  info->height = kSensorHeight;
  info->distortion_model = model;
  info->D = D;
  info->K = {50.0, 0.0, 29.0, 0.0, 52.0, 19.0, 0.0, 0.0, 1.0};
  info->R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info->P = {45.0, 0.0, 30.0, 0.0, 0.0, 46.0, 20.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

/// Distorts a point on the plane z = 1 with the published formula of the distortion model.
Eigen::Vector2d distort(const std::string& model, const std::vector<double>& D, double x,
                        double y) {
  const double r2 = x * x + y * y;
  if (model == "equidistant") {
    const double r = std::sqrt(r2), theta = std::atan(r), t2 = theta * theta;
    const double theta_d = theta * (1.0 + t2 * (D[0] + t2 * (D[1] + t2 * (D[2] + t2 * D[3]))));
    return r > 0.0 ? Eigen::Vector2d(x * theta_d / r, y * theta_d / r) : Eigen::Vector2d(x, y);
  }
  if (D.empty()) return {x, y};
  double radial = 1.0 + r2 * (D[0] + r2 * (D[1] + r2 * D[4]));
  if (D.size() >= 8) radial /= 1.0 + r2 * (D[5] + r2 * (D[6] + r2 * D[7]));
  return {x * radial + 2.0 * D[2] * x * y + D[3] * (r2 + 2.0 * x * x),
          y * radial + D[2] * (r2 + 2.0 * y * y) + 2.0 * D[3] * x * y};
}

const std::vector<double> kPlumbBob{-0.25, 0.08, 0.004, -0.003, 0.01};
const std::vector<double> kRational{0.4, 0.1, 0.001, -0.002, 0.02, 0.7, 0.2, 0.03};
const std::vector<double> kFisheye{-0.05, 0.02, -0.01, 0.003};

std::vector<double> padded(std::vector<double> D, size_t size) {
  D.resize(size);
  return D;
}

/// Checks that each valid pixel has the value of the raw pixel nearest to its ray. If two raw
/// pixels are equally near, either value is accepted. Returns the number of valid pixels.
int checkPixels(const sensor_msgs::CameraInfo& info, const sensor_msgs::Image& rectified,
                const Eigen::Vector4d& K, const Eigen::Vector4d& P) {
  int measured = 0;
  for (int v = 0; v < kSensorHeight; ++v) {
    for (int u = 0; u < kSensorWidth; ++u) {
      const int value = valueAt(rectified, u, v);
      if (value == 0) continue;
      ++measured;
      const Eigen::Vector2d d =
          distort(info.distortion_model, info.D, (u - P[2]) / P[0], (v - P[3]) / P[1]);
      EXPECT_NEAR((value - 100) % kSensorWidth, K[0] * d.x() + K[2], 0.501) << u << " " << v;
      EXPECT_NEAR((value - 100) / kSensorWidth, K[1] * d.y() + K[3], 0.501) << u << " " << v;
    }
  }
  return measured;
}

TEST(Rectification, UndoesEachDistortionModel) {
  for (const auto& [model, D] :
       {std::pair("plumb_bob", kPlumbBob), std::pair("rational_polynomial", kRational),
        std::pair("plumb_bob", kRational), std::pair("rational_polynomial", kPlumbBob),
        std::pair("rational_polynomial", padded(kRational, 12)),
        std::pair("rational_polynomial", padded(kRational, 14)),
        std::pair("plumb_bob", padded({}, 5)), std::pair("", std::vector<double>()),
        std::pair("equidistant", kFisheye)}) {
    const auto info = makeInfo(model, D);
    Rectification rectification(Usage::kAuto, "/camera/depth/image_raw");
    const CameraImage camera = rectification.apply({makeRawImage(), info});
    EXPECT_EQ(rectification.warning(), "");
    const int measured = checkPixels(*info, *camera.image, {50, 52, 29, 19}, {45, 46, 30, 20});
    EXPECT_GT(measured, kSensorWidth * kSensorHeight / 2) << model;
    EXPECT_EQ(camera.info->P[0], 45.0);
    EXPECT_EQ(camera.info->P[6], 20.0);
    EXPECT_EQ(camera.info->width, static_cast<uint32_t>(kSensorWidth));
  }
}

TEST(Rectification, HandlesBinningAndRegionOfInterest) {
  const auto info = makeInfo("plumb_bob", kPlumbBob);
  info->width = 400;
  info->height = 300;
  info->K = {100.0, 0.0, 78.0, 0.0, 104.0, 58.0, 0.0, 0.0, 1.0};
  info->P = {90.0, 0.0, 80.0, 0.0, 0.0, 92.0, 60.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  info->binning_x = info->binning_y = 2;
  info->roi.x_offset = info->roi.y_offset = 20;
  info->roi.width = 2 * kSensorWidth;
  info->roi.height = 2 * kSensorHeight;
  Rectification rectification(Usage::kAuto, "image_raw");
  const CameraImage camera = rectification.apply({makeRawImage(), info});
  EXPECT_GT(checkPixels(*info, *camera.image, {50, 52, 29, 19}, {45, 46, 30, 20}), 1200);
  EXPECT_EQ(camera.info->P[0], 45.0);
  EXPECT_EQ(camera.info->binning_x, 0u);
}

TEST(Rectification, LeavesRectifiedImagesUnchanged) {
  const auto image = makeRawImage();
  const auto isChanged = [&](Usage choice, const std::string& topic,
                             const sensor_msgs::CameraInfoPtr& info) {
    return Rectification(choice, topic).apply({image, info}).image != image;
  };
  const auto distorted = makeInfo("plumb_bob", kPlumbBob), plain = makeInfo("plumb_bob", {});
  const auto zeros = makeInfo("plumb_bob", std::vector<double>(5, 0.0));
  EXPECT_TRUE(isChanged(Usage::kAuto, "/camera/depth/image_raw", distorted));
  EXPECT_TRUE(isChanged(Usage::kAuto, "/rectified/image", distorted));
  EXPECT_FALSE(isChanged(Usage::kAuto, "/camera/depth/image_rect_raw", distorted));
  EXPECT_FALSE(isChanged(Usage::kAuto, "/d/image_rect/compressedDepth", distorted));
  EXPECT_FALSE(isChanged(Usage::kAuto, "image_rect", zeros));
  EXPECT_TRUE(isChanged(Usage::kAuto, "image_raw", plain)) << "P differs from K";
  plain->P = {50.0, 0.0, 29.0, 0.0, 0.0, 52.0, 19.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  EXPECT_FALSE(isChanged(Usage::kAuto, "image_raw", plain));
  plain->R = {0.8, 0.0, 0.6, 0.0, 1.0, 0.0, -0.6, 0.0, 0.8};
  EXPECT_FALSE(isChanged(Usage::kAuto, "image_raw", plain)) << "depth is not rotated";
  plain->K.fill(0.0);
  EXPECT_FALSE(isChanged(Usage::kAuto, "image_raw", plain));
  EXPECT_TRUE(isChanged(Usage::kAlways, "image_rect", distorted));
  EXPECT_FALSE(isChanged(Usage::kNever, "image_raw", distorted));
}

TEST(Rectification, WarnsIfDistortionRemains) {
  ros::Time::init();  // needed to log warnings
  Rectification never(Usage::kNever, "/image_raw");
  EXPECT_EQ(never.warning(), "");
  for (int i = 0; i < 2; ++i) never.apply({makeRawImage(), makeInfo("plumb_bob", kPlumbBob)});
  EXPECT_NE(never.warning().find("'/image_raw' are distorted"), std::string::npos);
  const auto rotated = makeInfo("plumb_bob", {});
  rotated->R = {0.8, 0.0, 0.6, 0.0, 1.0, 0.0, -0.6, 0.0, 0.8};
  Rectification of_depth(Usage::kAuto, "/image_raw");
  of_depth.apply({makeRawImage(), rotated});
  EXPECT_NE(of_depth.warning().find("R of camera_info"), std::string::npos);
  const std::pair<std::string, std::vector<double>> unknown[] = {{"kannala_brandt7", kFisheye},
                                                                 {"plumb_bob", {0.1, 0.0, 0.0}},
                                                                 {"equidistant", kPlumbBob},
                                                                 {"", kPlumbBob}};
  for (const auto& [model, D] : unknown) {
    Rectification automatic(Usage::kAuto, "/image_raw");
    const auto image = makeRawImage();
    EXPECT_EQ(automatic.apply({image, makeInfo(model, D)}).image, image);
    EXPECT_NE(automatic.warning().find("distortion model '" + model + "' with " +
                                       std::to_string(D.size())),
              std::string::npos);
  }
}

TEST(Rectification, NonFiniteCoefficientsYieldNoMeasurements) {
  const auto info = makeInfo("plumb_bob", {NAN, INFINITY, 1e300, 0.0, 0.0});
  const CameraImage camera = Rectification(Usage::kAuto, "image_raw").apply({makeRawImage(), info});
  for (const uint8_t byte : camera.image->data) EXPECT_EQ(byte, 0);
}

TEST(Rectification, FollowsChangesOfTheCameraInfo) {
  Rectification rectification(Usage::kAuto, "image_raw");
  const auto first = makeInfo("plumb_bob", kPlumbBob), second = makeInfo("plumb_bob", kPlumbBob);
  second->P[0] = 40.0;
  const CameraImage a = rectification.apply({makeRawImage(), first});
  EXPECT_EQ(rectification.apply({makeRawImage(), first}).image->data, a.image->data);
  const CameraImage b = rectification.apply({makeRawImage(), second});
  EXPECT_NE(b.image->data, a.image->data);
  EXPECT_EQ(b.info->P[0], 40.0);
}

}  // namespace
}  // namespace dtsdf
