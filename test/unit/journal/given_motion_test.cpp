// Tests that GivenMotion detects whether a pose source has adopted a correction.
#include "journal/pose_correction.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dtsdf {
namespace {

/// The pose of a camera that moves at 1 m/s along x and turns at 0.5 rad/s about z.
Eigen::Isometry3d poseAtTime(double stamp_s) {
  Eigen::Isometry3d T(Eigen::AngleAxisd(0.5 * stamp_s, Eigen::Vector3d::UnitZ()));
  T.translation() = Eigen::Vector3d(stamp_s, 0.0, 0.0);
  return T;
}

GivenMotion seenUpTo(int count) {
  GivenMotion motion;
  for (int i = 0; i < count; ++i) motion.add({0.1 * i, poseAtTime(0.1 * i)});
  return motion;
}

// Jumps along the path are detected as well, even if they are only half as long as the distance
// between two consecutive images.
TEST(GivenMotion, JumpsAlongThePathAreDetected) {
  const GivenMotion motion = seenUpTo(10);
  for (const double x : {-0.5, -0.1, -0.05, 0.05, 0.1, 0.5}) {
    const Eigen::Isometry3d T(Eigen::Translation3d(x, 0.0, 0.0));
    for (const double next_s : {1.0, 1.1, 0.95}) {
      EXPECT_FALSE(motion.isMovedBy(T, {next_s, poseAtTime(next_s)})) << x << " at " << next_s;
      EXPECT_TRUE(motion.isMovedBy(T, {next_s, T * poseAtTime(next_s)})) << x << " at " << next_s;
    }
  }
}

TEST(GivenMotion, RotationJumpsAreDetected) {
  const GivenMotion motion = seenUpTo(10);
  const Eigen::Isometry3d T(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitZ()));
  EXPECT_FALSE(motion.isMovedBy(T, {1.0, poseAtTime(1.0)}));
  EXPECT_TRUE(motion.isMovedBy(T, {1.0, T * poseAtTime(1.0)}));
}

TEST(GivenMotion, JumpsAreDetectedAfterOnePose) {
  const Eigen::Isometry3d T(Eigen::Translation3d(0.1, 0.0, 0.0));
  EXPECT_FALSE(GivenMotion().isMovedBy(T, {0.0, T}));
  GivenMotion motion;
  motion.add({0.0, Eigen::Isometry3d::Identity()});
  EXPECT_TRUE(motion.isMovedBy(T, {0.1, T}));
  EXPECT_FALSE(motion.isMovedBy(T, {0.1, Eigen::Isometry3d::Identity()}));
}

// After a pause, a camera that was moving may be anywhere, so a jump does not show that the source
// has adopted a correction. A camera that stood still is assumed not to have moved.
TEST(GivenMotion, JumpsAfterAPauseCountOnlyIfStill) {
  const Eigen::Isometry3d T(Eigen::Translation3d(0.2, 0.0, 0.0));
  for (double next_s = 1.5; next_s < 31.0; next_s += 0.1) {
    GivenMotion drives = seenUpTo(10);
    for (double at_s = 0.9; at_s < 2.0; at_s += 0.02) {
      EXPECT_FALSE(drives.isMovedBy(T, {next_s, poseAtTime(at_s)})) << at_s << " at " << next_s;
    }
    GivenMotion stands;
    for (int i = 0; i < 10; ++i) stands.add({0.1 * i, poseAtTime(3.0)});
    EXPECT_FALSE(stands.isMovedBy(T, {next_s, poseAtTime(3.0)})) << next_s;
    EXPECT_TRUE(stands.isMovedBy(T, {next_s, T * poseAtTime(3.0)})) << next_s;
  }
}

// The 2 cm tremor of a hand-held camera that sometimes stops must never be mistaken for the
// adoption of a 1 cm correction.
TEST(GivenMotion, TremblingIsNotMistakenForACorrection) {
  const Eigen::Isometry3d T(Eigen::Translation3d(0.0, 0.01, 0.0));
  GivenMotion hand;
  for (int i = 0; i < 300; ++i) {
    Eigen::Isometry3d pose = poseAtTime(i % 50 < 25 ? 0.1 * (i % 25) : 2.5);
    pose.translation().y() += 0.02 * std::sin(2.1 * i);
    EXPECT_FALSE(hand.adoptsCorrection(T, {0.1 * i, pose})) << i;
  }
}

// A detected jump does not count as uneven motion, so the next jump is detected as well.
TEST(GivenMotion, ConsecutiveJumpsAreDetected) {
  const Eigen::Isometry3d T(Eigen::Translation3d(0.0, 0.05, 0.0));
  GivenMotion motion = seenUpTo(10);
  Eigen::Isometry3d so_far = Eigen::Isometry3d::Identity();
  for (int i = 10; i < 16; ++i) {
    so_far = T * so_far;
    EXPECT_TRUE(motion.adoptsCorrection(T, {0.1 * i, so_far * poseAtTime(0.1 * i)})) << i;
  }
}

TEST(GivenMotion, StampsGoingBackBeginANewRecording) {
  const GivenMotion motion = seenUpTo(10);
  EXPECT_FALSE(motion.isNewRecording({0.5, poseAtTime(0.5)}))
      << "a stamp slightly out of order should not begin a recording";
  EXPECT_TRUE(motion.isNewRecording({0.3, poseAtTime(0.3)}));
}

TEST(GivenMotion, ACorrectionIsAdoptedOnlyOnce) {
  const Eigen::Isometry3d T(Eigen::Translation3d(0.0, 2.0, 0.0));
  GivenMotion motion = seenUpTo(10);
  EXPECT_FALSE(motion.adoptsCorrection(T, {1.0, poseAtTime(1.0)}));
  EXPECT_TRUE(motion.adoptsCorrection(T, {1.1, T * poseAtTime(1.1)}));
  EXPECT_FALSE(motion.adoptsCorrection(T, {1.2, T * poseAtTime(1.2)}));
  EXPECT_TRUE(motion.adoptsCorrection(T, {0.3, poseAtTime(0.3)}));
  EXPECT_FALSE(motion.isNewRecording({0.3, poseAtTime(0.3)})) << "the stamp should have been added";
}

}  // namespace
}  // namespace dtsdf
