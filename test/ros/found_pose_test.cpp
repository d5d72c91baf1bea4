#include "ros/steps/pose_publisher.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSigma_m = 0.05, kSigma_rad = 0.035;

/// Held to 1 mm and 1 mrad, but along one axis, along which it is where it was expected.
Alignment slidingAlong(const Vector3d& axis) {
  Alignment alignment;
  alignment.status = AlignmentStatus::kAligned;
  alignment.covariance.diagonal().setConstant(1e-6);
  alignment.covariance.topLeftCorner<3, 3>() += kSigma_m * kSigma_m * axis * axis.transpose();
  return alignment;
}

TEST(FoundPose, AnAxisThatIsNotHeldIsFree) {
  const Vector3d along = Vector3d(1.0, 2.0, -0.5).normalized();
  const Alignment alignment = slidingAlong(along);
  const Matrix3d shifts = alignment.covariance.topLeftCorner<3, 3>();
  const auto axes = freeAxes(shifts, kSigma_m);
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_NEAR(std::abs(axes[0].dot(along)), 1.0, 1e-9);
  const Matrix3d turns = alignment.covariance.bottomRightCorner<3, 3>();
  EXPECT_TRUE(freeAxes(turns, kSigma_rad).empty());
  EXPECT_EQ(freeAxes(kSigma_m * kSigma_m * Matrix3d::Identity(), kSigma_m).size(), 3u);
}

TEST(FoundPose, TrackedPosesAreUnknownAlongWhatIsFree) {
  const Vector3d along = Vector3d(3.0, 4.0, 0.0) / 5.0;
  PoseParams params;
  params.mode = PoseMode::kTrack;
  const Matrix6d tracked = odometryCovariance(slidingAlong(along), params);
  const Matrix3d shifts = tracked.topLeftCorner<3, 3>();
  EXPECT_GT(along.dot(shifts * along), 100.0);
  EXPECT_LT(Vector3d::UnitZ().dot(shifts * Vector3d::UnitZ()), 1e-5);
  EXPECT_TRUE(tracked.isApprox(tracked.transpose()));
  params.mode = PoseMode::kRefine;  // TF's error does not add up
  EXPECT_EQ(odometryCovariance(slidingAlong(along), params), slidingAlong(along).covariance);
  Alignment first;
  first.covariance.diagonal().setConstant(kSigma_m * kSigma_m);
  params.mode = PoseMode::kTrack;
  EXPECT_EQ(odometryCovariance(first, params), first.covariance) << "it is where it was given";
}

/// Against the errors themselves: those of the camera, moved as a rigid body moves.
TEST(FoundPose, ErrorsMoveWithTheBody) {
  Eigen::Matrix<double, 6, 1> error;
  error << 0.01, -0.02, 0.03, 0.001, 0.002, -0.003;
  const Matrix3d R_M_W = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).matrix();
  const Vector3d offset_M(0.3, -0.2, 0.5);
  const Vector3d turn_M = R_M_W * error.tail<3>();
  Eigen::Matrix<double, 6, 1> moved;
  moved << R_M_W * error.head<3>() + turn_M.cross(offset_M), turn_M;
  const Matrix6d expected = moved * moved.transpose();
  EXPECT_TRUE(
      movedCovariance(error * error.transpose(), R_M_W, offset_M).isApprox(expected, 1e-12));
}

}  // namespace
}  // namespace dtsdf
