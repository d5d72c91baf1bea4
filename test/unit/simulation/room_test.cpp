#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulation/scene.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kLap_s = 24.0;
constexpr int kViews = 48;
constexpr int kWidth = 160, kHeight = 120;
const Intrinsics kIntrinsics{138.5f, 138.5f, 79.5f, 59.5f};

TEST(Room, LapIsClosedAndSmooth) {
  EXPECT_TRUE(roomCameraPose(0.0, kLap_s).isApprox(roomCameraPose(kLap_s, kLap_s), 1e-9));
  constexpr double kPeriod_s = 1.0 / 30.0;
  for (double time_s = 0.0; time_s < kLap_s; time_s += kPeriod_s) {
    const Eigen::Isometry3d T_W_C = roomCameraPose(time_s, kLap_s);
    const Eigen::Isometry3d step = T_W_C.inverse() * roomCameraPose(time_s + kPeriod_s, kLap_s);
    EXPECT_LT(step.translation().norm(), 0.05);
    EXPECT_LT(Eigen::AngleAxisd(step.linear()).angle(), 0.05);
  }
}

TEST(Room, CameraStaysInFreeSpace) {
  const Scene scene = makeRoomScene();
  for (double time_s = 0.0; time_s < kLap_s; time_s += 0.05) {
    EXPECT_GT(scene.signedDistance(roomCameraPose(time_s, kLap_s).translation()), 0.3);
  }
}

TEST(Room, BallsMoveClearOfCameraAndThings) {
  EXPECT_TRUE(roomBalls(0, 1.0).empty());
  const Scene scene = makeRoomScene();
  for (double time_s = 0.0; time_s < kLap_s; time_s += 0.05) {
    const auto balls = roomBalls(3, time_s), later = roomBalls(3, time_s + 0.1);
    ASSERT_EQ(balls.size(), 3u);
    for (size_t i = 0; i < balls.size(); ++i) {
      EXPECT_GT((later[i].centre_W - balls[i].centre_W).norm(), 0.01);
      EXPECT_GT(scene.signedDistance(balls[i].centre_W), -balls[i].radius_m);  // not inside
      // Whatever the camera's lap is, and wherever it is in it.
      for (double other_s = 0.0; other_s < kLap_s; other_s += 0.1) {
        const Vector3d eye_W = roomCameraPose(other_s, kLap_s).translation();
        EXPECT_GT((eye_W - balls[i].centre_W).norm() - balls[i].radius_m, 0.3);
      }
    }
  }
}

/// Whether some view of a lap measures the surface at p_W.
bool isSeen(const Scene& scene, const Vector3d& p_W) {
  for (int i = 0; i < kViews; ++i) {
    const Eigen::Isometry3d T_W_C = roomCameraPose(kLap_s * i / kViews, kLap_s);
    const Vector3d p_C = T_W_C.inverse() * p_W;
    if (p_C.z() <= 0.0) continue;
    const double u = kIntrinsics.fx * p_C.x() / p_C.z() + kIntrinsics.cx;
    const double v = kIntrinsics.fy * p_C.y() / p_C.z() + kIntrinsics.cy;
    if (u < 0.0 || v < 0.0 || u > kWidth - 1.0 || v > kHeight - 1.0) continue;
    const double s = scene.intersect(T_W_C.translation(), p_W - T_W_C.translation());
    if (std::abs(s - 1.0) < 1e-6) return true;
  }
  return false;
}

TEST(Room, BothSidesOfWallAndPlatesAreSeen) {
  const Scene scene = makeRoomScene();
  int sides = 0;
  for (const Shape& shape : scene.shapes()) {
    const auto* box = std::get_if<Box>(&shape);
    if (box == nullptr) continue;
    const int thin = std::min_element(box->half_size_m.data(), box->half_size_m.data() + 3) -
                     box->half_size_m.data();
    const bool in_the_middle = box->T_W_B.translation().head<2>().norm() < 1.5;
    if (!in_the_middle || box->half_size_m[thin] > 0.021 || thin != 1) continue;
    for (const double side : {-1.0, 1.0}) {
      const Vector3d p_B(0.3 * box->half_size_m.x(), side * box->half_size_m.y(),
                         0.5 * box->half_size_m.z());
      EXPECT_TRUE(isSeen(scene, box->T_W_B * p_B)) << box->T_W_B.translation().transpose();
      ++sides;
    }
  }
  EXPECT_EQ(sides, 8) << "the wall and three plates";
}

}  // namespace
}  // namespace dtsdf
