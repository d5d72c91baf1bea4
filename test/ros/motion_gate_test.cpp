#include "ros/input/pose_checks.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

Eigen::Isometry3d poseAt(double x_m, double turn_deg = 0.0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = x_m;
  T.linear() =
      Eigen::AngleAxisd(turn_deg * M_PI / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

TEST(MotionGate, LosesOneFrameWhenThePoseJumpsAndStays) {
  MotionGate gate(10.0, 720.0);
  EXPECT_FALSE(gate.check(1.0, poseAt(0.0)));
  EXPECT_FALSE(gate.check(1.1, poseAt(0.9)));
  EXPECT_TRUE(gate.check(1.2, poseAt(2.0)));
  EXPECT_FALSE(gate.check(1.3, poseAt(2.1)));
}

TEST(MotionGate, SeesTurns) {
  MotionGate gate(10.0, 720.0);
  EXPECT_FALSE(gate.check(1.0, poseAt(0.0)));
  EXPECT_FALSE(gate.check(1.1, poseAt(0.0, 70.0)));
  EXPECT_TRUE(gate.check(1.2, poseAt(0.0, 150.0)));
}

TEST(MotionGate, StartsAnewWhenStampsGoBackAndCanBeSwitchedOff) {
  MotionGate gate(10.0, 720.0);
  EXPECT_FALSE(gate.check(100.0, poseAt(0.0)));
  EXPECT_FALSE(gate.check(1.0, poseAt(50.0)));
  MotionGate off(0.0, 0.0);
  EXPECT_FALSE(off.check(1.0, poseAt(0.0)));
  EXPECT_FALSE(off.check(1.1, poseAt(500.0, 180.0)));
}

}  // namespace
}  // namespace dtsdf
