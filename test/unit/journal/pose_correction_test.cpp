// Tests, on simple paths, how corrected poses of some images change the poses of all images.
#include "journal/pose_correction.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

Eigen::Isometry3d pose(double x, double y, double yaw) {
  Eigen::Isometry3d T(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  T.translation() = Eigen::Vector3d(x, y, 0.5);
  return T;
}

/// The path of a camera that moves along x at 1 m/s while turning, with ten images per second.
std::vector<StampedPose> straightPath(int count) {
  std::vector<StampedPose> path;
  for (int i = 0; i < count; ++i) path.push_back({0.1 * i, pose(0.1 * i, 0.0, 0.05 * i)});
  return path;
}

double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() + (a.linear() - b.linear()).norm();
}

// If all corrected poses differ from the fused poses by the same rigid motion, the poses before,
// between and after them are moved by that motion, too.
TEST(PoseCorrection, RigidMotionOfSomePosesMovesAll) {
  const std::vector<StampedPose> fused = straightPath(40);
  const Eigen::Isometry3d T = pose(0.3, -2.0, 0.4);
  const PoseCorrection correction({{1.0, T * fused[10].T_W_C}, {2.0, T * fused[20].T_W_C}}, fused);
  EXPECT_EQ(correction.used().size(), 2u);
  for (const StampedPose& image : fused) {
    const Eigen::Isometry3d moved = correction.correct(image.stamp_s, image.T_W_C);
    if (image.stamp_s < 1.05 || image.stamp_s > 1.95) {
      EXPECT_LT(distance(moved, T * image.T_W_C), 1e-12) << image.stamp_s;
    } else {  // interpolated with slerp, which rounds
      EXPECT_LT(distance(moved, T * image.T_W_C), 1e-9) << image.stamp_s;
    }
  }
}

TEST(PoseCorrection, CorrectedImagesGetTheGivenPose) {
  const std::vector<StampedPose> fused = straightPath(30);
  const Eigen::Isometry3d to = pose(1.02, 0.01, 0.52);
  const PoseCorrection correction({{1.0004, to}, {2.0, pose(2.0, 0.2, 1.0)}}, fused);
  EXPECT_EQ(correction.correct(1.0, fused[10].T_W_C).matrix(), to.matrix());
}

// Sideways drift, from 0 at 1 s to 20 cm at 2 s, is removed in proportion to time.
TEST(PoseCorrection, DriftIsDistributedByTime) {
  const std::vector<StampedPose> fused = straightPath(40);
  Eigen::Isometry3d to = fused[20].T_W_C;
  to.translation().y() += 0.2;
  const PoseCorrection correction({{1.0, fused[10].T_W_C}, {2.0, to}}, fused);
  for (int i = 0; i < 40; ++i) {
    const double share = std::min(1.0, std::max(0.0, (i - 10) / 10.0));
    Eigen::Isometry3d expected = fused[static_cast<size_t>(i)].T_W_C;
    expected.translation().y() += 0.2 * share;
    EXPECT_LT(distance(correction.correct(0.1 * i, fused[static_cast<size_t>(i)].T_W_C), expected),
              1e-9)
        << i;
  }
}

// A pose that differs only by the rounding in a text file counts as unchanged. Images up to its
// stamp keep their poses, bit for bit.
TEST(PoseCorrection, UnmovedPosesStayBitIdentical) {
  const std::vector<StampedPose> fused = straightPath(40);
  Eigen::Isometry3d rounded = fused[10].T_W_C;
  rounded.translation().x() += 4e-7;  // files have six decimals
  const PoseCorrection correction({{1.0, rounded}, {2.0, pose(2.0, 0.3, 1.0)}}, fused);
  for (int i = 0; i <= 10; ++i) {
    const Eigen::Isometry3d& before = fused[static_cast<size_t>(i)].T_W_C;
    EXPECT_EQ(correction.correct(0.1 * i, before).matrix(), before.matrix()) << i;
  }
  EXPECT_NE(correction.correct(1.1, fused[11].T_W_C).matrix(), fused[11].T_W_C.matrix());
}

// A SLAM system may provide poses for times between images. Here, one is 0.04 s after an image.
TEST(PoseCorrection, APoseBetweenImagesCorrectsThemToo) {
  const std::vector<StampedPose> fused = straightPath(20);
  Eigen::Isometry3d T_W_C = pose(0.54, 0.0, 0.27);
  T_W_C.translation().y() += 0.1;
  const PoseCorrection correction({{0.54, T_W_C}}, fused);
  Eigen::Isometry3d expected = fused[12].T_W_C;
  expected.translation().y() += 0.1;
  EXPECT_LT(distance(correction.correct(1.2, fused[12].T_W_C), expected), 1e-9);
}

// A second camera, rigidly mounted to the first, takes images at different times.
TEST(PoseCorrection, AttachedCamerasAreCorrectedToo) {
  const std::vector<StampedPose> fused = straightPath(20);
  const Eigen::Isometry3d T = pose(0.0, 0.1, 0.02), mount = pose(0.2, 0.1, 1.5);
  const PoseCorrection correction({{1.0, T * fused[10].T_W_C}}, fused);
  EXPECT_LT(distance(correction.correct(0.73, pose(0.73, 0.0, 0.365) * mount),
                     T * pose(0.73, 0.0, 0.365) * mount),
            1e-12);
}

TEST(PoseCorrection, RefusesInvalidCorrections) {
  const std::vector<StampedPose> fused = straightPath(20);
  const auto errorFor = [&](const StampedPose& wrong) {
    return errorOf([&] { PoseCorrection({{0.5, fused[5].T_W_C}, wrong}, fused); });
  };
  StampedPose wrong = fused[10];
  wrong.T_W_C.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(errorFor(wrong).find("not a rigid transform"), std::string::npos);
  wrong = fused[10];
  wrong.T_W_C.linear() *= 1.5;
  EXPECT_NE(errorFor(wrong).find("not a rigid transform"), std::string::npos);
  wrong = fused[10];
  wrong.T_W_C.linear().col(0) *= -1.0;
  EXPECT_NE(errorFor(wrong).find("not a rigid transform"), std::string::npos);
  wrong = fused[10];
  wrong.T_W_C.translation().x() += 10000.0;
  EXPECT_NE(errorFor(wrong).find("10000 m"), std::string::npos) << errorFor(wrong);
  wrong = fused[10];
  wrong.stamp_s = std::numeric_limits<double>::infinity();
  EXPECT_NE(errorFor(wrong).find("not a rigid transform"), std::string::npos);
  wrong = {0.5, fused[6].T_W_C};  // like rtabmap's mapPath, with one stamp for all poses
  EXPECT_NE(errorFor(wrong).find("the same stamp, 0.500 s"), std::string::npos) << errorFor(wrong);
  EXPECT_EQ(errorFor({0.5, fused[5].T_W_C}), "") << "a pose that is given twice should be accepted";
  const std::string other = errorOf([&] { PoseCorrection({{500.0, fused[0].T_W_C}}, fused); });
  EXPECT_NE(other.find("no corrected pose matches the stamp"), std::string::npos) << other;
  EXPECT_NE(errorOf([&] { PoseCorrection({}, fused); }), "");
  EXPECT_NE(errorOf([&] { PoseCorrection({{0.0, fused[0].T_W_C}}, {}); }), "");
}

// The corrected path may contain poses of images that were not fused. Such poses are ignored,
// since the fused path at their stamps is unknown. Here, the path is a zigzag.
TEST(PoseCorrection, PosesOfDroppedImagesAreIgnored) {
  std::vector<StampedPose> path;
  for (int i = 0; i < 20; ++i) path.push_back({0.1 * i, pose(0.1 * i, 0.2 * (i % 2), 0.05 * i)});
  const std::vector<StampedPose> corrected(path.begin(), path.begin() + 14);
  for (const int dropped : {6, 13}) {
    std::vector<StampedPose> fused = path;
    fused.erase(fused.begin() + dropped);
    const PoseCorrection correction(corrected, fused);
    EXPECT_EQ(correction.used().size(), 13u);
    EXPECT_EQ(correction.farthest(), 0.0);
    for (const StampedPose& image : fused) {
      EXPECT_EQ(correction.correct(image.stamp_s, image.T_W_C).matrix(), image.T_W_C.matrix())
          << "without " << dropped << ", at " << image.stamp_s;
    }
  }
}

// The motion in a long gap between images is unknown, so a pose there cannot be used.
TEST(PoseCorrection, APoseInALongGapIsNotUsed) {
  std::vector<StampedPose> fused = straightPath(10);
  fused.push_back({5.0, pose(5.0, 0.0, 0.0)});
  EXPECT_NE(errorOf([&] { PoseCorrection({{3.0, pose(3.0, 0.0, 0.0)}}, fused); }), "");
}

}  // namespace
}  // namespace dtsdf
