#include "io/trajectory.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// A pose at x metres along the x axis, rotated by `angle` about z.
StampedPose makePose(double stamp_s, double x, double angle) {
  StampedPose pose{stamp_s, Eigen::Isometry3d::Identity()};
  pose.T_W_C.translate(Eigen::Vector3d(x, 0, 0));
  pose.T_W_C.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
  return pose;
}

double angleOf(const Eigen::Isometry3d& T) { return Eigen::AngleAxisd(T.rotation()).angle(); }

TEST(Trajectory, InterpolatesBetweenNeighbours) {
  const Trajectory trajectory({makePose(1.0, 1, 0.0), makePose(1.04, 5, kPi / 2)});
  const auto T = trajectory.poseAt(1.01, 0.02);
  ASSERT_TRUE(T);
  EXPECT_NEAR(T->translation().x(), 2.0, 1e-9);
  EXPECT_NEAR(angleOf(*T), kPi / 8, 1e-9);
}

TEST(Trajectory, TurnsTheShortWay) {
  const Trajectory trajectory({makePose(0.0, 0, -3.0), makePose(1.0, 0, 3.0)});
  EXPECT_NEAR(angleOf(*trajectory.poseAt(0.5, 1.0)), kPi, 1e-9);
}

TEST(Trajectory, HasNoPoseBeyondTheTolerance) {
  const Trajectory trajectory({makePose(1.0, 1, 0), makePose(2.0, 2, 0)});
  EXPECT_FALSE(trajectory.poseAt(1.5, 0.02));
  EXPECT_FALSE(trajectory.poseAt(0.9, 0.02));
  EXPECT_FALSE(trajectory.poseAt(2.1, 0.02));
  EXPECT_TRUE(trajectory.poseAt(1.02, 0.02));  // even if rounding puts it just over the limit
  EXPECT_TRUE(trajectory.poseAt(1.98, 0.02));
}

TEST(Trajectory, DoesNotExtrapolate) {
  const Trajectory trajectory({makePose(1.0, 1, 0), makePose(2.0, 2, 0)});
  EXPECT_EQ(trajectory.poseAt(0.99, 0.02)->translation().x(), 1.0);
  EXPECT_EQ(trajectory.poseAt(2.01, 0.02)->translation().x(), 2.0);
}

TEST(Trajectory, SortsAndKeepsTheFirstOfEqualStamps) {
  const Trajectory trajectory({makePose(2.0, 2, 0), makePose(1.0, 1, 0), makePose(2.0, 9, 0)});
  ASSERT_EQ(trajectory.poses().size(), 2u);
  EXPECT_EQ(trajectory.poseAt(2.0, 0.0)->translation().x(), 2.0);
}

/// Doubles resolve present-day stamps to a quarter of a microsecond, so nine decimals would show
/// rounding errors.
TEST(Trajectory, WritesStampsAsTheyWereRead) {
  for (const char* text : {"1600000000.600000", "1311868164.363181", "0.300000", "7.000000"}) {
    EXPECT_EQ(stampOfList(std::stod(text)), text);
  }
  EXPECT_EQ(stampOfList(0.123456789), "0.123456789");
}

TEST(Trajectory, IsSavedAndReadBack) {
  const TemporaryFolder folder;
  const std::string path = folder / "trajectory.txt";
  const std::vector<StampedPose> poses = {makePose(1311868164.363181, 1.23456789, 0.7),
                                          makePose(1311868164.399026, -2e4, -2.9)};
  saveTrajectory(poses, path);
  const Trajectory read = readTrajectory(path, "");
  ASSERT_EQ(read.poses().size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.poses()[i].stamp_s, poses[i].stamp_s);
    EXPECT_TRUE(read.poses()[i].T_W_C.isApprox(poses[i].T_W_C, 1e-9));
  }
}

}  // namespace
}  // namespace dtsdf
