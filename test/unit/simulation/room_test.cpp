#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulation/scene.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kLap_s = 24.0;

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

TEST(Room, BallsMoveInSightAndClearOfTheCamera) {
  EXPECT_TRUE(roomBalls(0, 1.0).empty());
  const Scene scene = makeRoomScene();
  for (double time_s = 0.0; time_s < kLap_s; time_s += 0.05) {
    const auto balls = roomBalls(3, time_s), later = roomBalls(3, time_s + 0.1);
    ASSERT_EQ(balls.size(), 3u);
    for (size_t i = 0; i < balls.size(); ++i) {
      EXPECT_GT((later[i].centre_W - balls[i].centre_W).norm(), 0.01);
      EXPECT_GT(scene.signedDistance(balls[i].centre_W),
                -balls[i].radius_m);  // not hidden inside an object
      // The balls must be in free space wherever the camera is on its lap.
      for (double other_s = 0.0; other_s < kLap_s; other_s += 0.1) {
        const Vector3d eye_W = roomCameraPose(other_s, kLap_s).translation();
        EXPECT_GT((eye_W - balls[i].centre_W).norm() - balls[i].radius_m, 0.3);
      }
    }
  }
}

}  // namespace
}  // namespace dtsdf
