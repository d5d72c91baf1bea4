#include "ros/steps/poses.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "ros/support/map_host.h"

namespace dtsdf {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Uses a fake mapper that only aligns frames within 0.1 m of camera_x_m_ along the x axis.
class PosesTest : public testing::Test {
 protected:
  PosesTest() {
    mapper_->aligns = [this](const DepthFrame& frame) {
      Alignment alignment;
      alignment.T_W_C = frame.T_W_C;
      if (mapper_->frames == 0) return alignment;
      ++alignments_;
      const double shift_m = camera_x_m_ - frame.T_W_C.translation().x();
      const bool fits = std::abs(shift_m) < 0.1;
      alignment.status = fits ? AlignmentStatus::kAligned : AlignmentStatus::kMisfit;
      alignment.is_significant = alignment.is_held = fits;
      alignment.reach_m = 0.2;
      alignment.matched_share = 1.0;
      alignment.inlier_share = fits ? 1.0 : 0.1;
      if (fits) alignment.T_W_C.translation().x() = camera_x_m_;
      alignment.shift_m = std::abs(shift_m);
      return alignment;
    };
  }

  void start(PoseMode mode) {
    params_.poses.mode = mode;
    host_ = std::make_unique<MapHost>(std::unique_ptr<Mapper>(mapper_), params_);
    auto poses = std::make_unique<PosesStep>(host_->host);
    poses_ = poses.get();
    host_->steps.push_back(std::move(poses));
  }

  /// Adds a frame with a pose from TF, which tracking ignores.
  void push(double stamp_s, double given_x_m = 0.0) {
    DepthFrame depth;
    depth.T_W_C.translation().x() = given_x_m;
    push(stamp_s, depth, 0, "camera");
  }

  void pushColour(double stamp_s, const std::string& frame_id) {
    push(stamp_s, ColourFrame{}, 1, frame_id);
  }

  template <class Image>
  void push(double stamp_s, const Image& image, size_t stream, const std::string& frame_id,
            size_t camera = 0) {
    PosedFrame frame;
    frame.camera = camera;
    frame.stamp = ros::Time(stamp_s);
    frame.image = image;
    frame.frame_id = frame_id;
    host_->push(stream, std::move(frame));
    host_->work();
    host_->clock.advance(1.0);  // frames waiting for another camera become due
    host_->work();
  }

  uint64_t dropped(const DropReason& reason) const {
    return host_->depth.counts().dropped_by[reason];
  }
  uint64_t fused() const { return host_->depth.counts().fused; }
  dtsdf_mapping::PoseStatus statusOf(size_t camera) {
    dtsdf_mapping::MapStatus status;
    status.cameras.resize(2);
    poses_->fill(status);
    return status.cameras[camera].pose;
  }
  double foundX_m() const { return poses_->published()->pose.pose.position.x; }

  void expectAccounted() const {
    const StreamReport counts = host_->depth.counts();
    EXPECT_EQ(counts.received, counts.fused + counts.droppedSum());
    EXPECT_EQ(counts.waiting, 0u);
  }

  NodeParams params_;
  FakeMapper* mapper_ = new FakeMapper;  ///< Owned by the map.
  double camera_x_m_ = 0.0;
  int alignments_ = 0;
  std::unique_ptr<MapHost> host_;  ///< Null before start().
  PosesStep* poses_ = nullptr;
};

TEST_F(PosesTest, RefinedFramesAreFusedAtAlignedPoses) {
  start(PoseMode::kRefine);
  push(1.0);
  EXPECT_EQ(alignments_, 0) << "the first frame should not be aligned to the empty map";
  push(1.1, 0.04);
  EXPECT_EQ(fused(), 2u);
  EXPECT_NEAR(foundX_m(), 0.0, 1e-9);
  EXPECT_EQ(poses_->published()->child_frame_id, "camera");
  EXPECT_EQ(poses_->fusedPoses().size(), 2u);
  expectAccounted();
}

TEST_F(PosesTest, TheMapStoresThePoseSettings) {
  params_.poses.sigma_m = 0.02;
  start(PoseMode::kRefine);
  push(1.0);
  EXPECT_EQ(toTree(host_->map.origin().poses), toTree<PoseParams>(params_.poses));
}

TEST_F(PosesTest, MisfitsAreFusedAtTheirGivenPose) {
  start(PoseMode::kRefine);
  push(1.0);
  camera_x_m_ = 5.0;
  push(1.1, 0.5);
  EXPECT_EQ(fused(), 2u);
  EXPECT_NEAR(foundX_m(), 0.5, 1e-9);
  EXPECT_EQ(statusOf(0).outcome, toString(AlignmentStatus::kMisfit));
  expectAccounted();
}

TEST_F(PosesTest, MisfitsCanBeDropped) {
  params_.poses.drop_misfits = true;
  start(PoseMode::kRefine);
  push(1.0);
  camera_x_m_ = 5.0;
  push(1.1, 0.5);
  EXPECT_EQ(fused(), 1u);
  EXPECT_EQ(dropped(drop::kMisfit), 1u);
  expectAccounted();
}

/// The input poses of two stationary cameras drift in opposite directions.
TEST_F(PosesTest, CamerasOfARigAreCorrectedSeparately) {
  params_.cameras = {"left", "right"};
  params_.poses.drift = 1.0;
  start(PoseMode::kRefine);
  std::vector<double> painted_x_m;
  mapper_->paints = [&](const ColourFrame& colour) {
    painted_x_m.push_back(colour.T_W_C.translation().x());
  };
  double fused_x_m[2] = {};
  for (int i = 0; i < 10; ++i) {
    for (const size_t camera : {0, 1}) {
      DepthFrame depth;
      depth.T_W_C.translation().x() = (camera == 0 ? 0.05 : -0.04) * i;
      const double stamp_s = 1.0 + 0.1 * i + 0.01 * static_cast<double>(camera);
      push(stamp_s, depth, 0, camera == 0 ? "left" : "right", camera);
      fused_x_m[camera] = mapper_->last_T_W_C.translation().x();
    }
  }
  EXPECT_EQ(fused(), 20u);
  for (const size_t camera : {0, 1}) {
    EXPECT_NEAR(fused_x_m[camera], 0.0, 1e-9);
    EXPECT_EQ(statusOf(camera).outcome, toString(AlignmentStatus::kAligned));
  }
  EXPECT_LT(poses_->T_M_O().translation().x(), -0.3)
      << "the correction of the first camera should be published";
  EXPECT_EQ(poses_->fusedPoses().size(), 10u);
  for (const size_t camera : {0, 1}) {
    ColourFrame colour;
    colour.T_W_C.translation().x() = camera == 0 ? 0.45 : -0.36;
    push(1.95 + 0.01 * static_cast<double>(camera), colour, 1, "colour", camera);
  }
  ASSERT_EQ(painted_x_m.size(), 2u);
  for (const double x_m : painted_x_m) EXPECT_NEAR(x_m, 0.0, 0.1) << "must move with its camera";
  expectAccounted();
}

TEST_F(PosesTest, StampsGoingBackResetTheCorrection) {
  params_.poses.drift = 1.0;
  start(PoseMode::kRefine);
  push(1.0, 0.0);
  for (int i = 1; i < 10; ++i) {  // odometry that moves while the camera is stationary
    push(1.0 + 0.1 * i, 0.05 * i);
  }
  EXPECT_LT(poses_->T_M_O().translation().x(), -0.2);
  const size_t before = fused();
  push(0.0, 0.0);
  EXPECT_EQ(fused(), before + 1);
  EXPECT_NEAR(poses_->T_M_O().translation().x(), 0.0, 1e-9);
}

TEST_F(PosesTest, TrackingStartsUprightWithoutAPose) {
  start(PoseMode::kTrack);
  push(1.0, 77.0);  // the pose from TF is ignored
  ASSERT_EQ(fused(), 1u);
  const Isometry3d T_M_C = readPose(poses_->published()->pose.pose);
  EXPECT_EQ(T_M_C.translation(), Vector3d::Zero());
  EXPECT_TRUE((T_M_C.linear() * Vector3d::UnitZ()).isApprox(Vector3d::UnitX()));  // facing ahead
  EXPECT_TRUE((T_M_C.linear() * -Vector3d::UnitY()).isApprox(Vector3d::UnitZ()));
  camera_x_m_ = 0.03;
  push(1.1);
  EXPECT_NEAR(foundX_m(), 0.03, 1e-9);
  expectAccounted();
}

TEST_F(PosesTest, ALostCameraFusesNothingUntilItFitsAgain) {
  start(PoseMode::kTrack);
  push(1.0);
  push(1.1);
  camera_x_m_ = 5.0;
  for (int i = 2; i < 6; ++i) push(1.0 + 0.1 * i);
  EXPECT_EQ(dropped(drop::kLost), 4u);
  EXPECT_NEAR(statusOf(0).lost_since.toSec(), 1.2, 1e-6);
  pushColour(1.55, "camera");
  EXPECT_EQ(host_->colour.counts().dropped_by[drop::kLost], 1u);
  camera_x_m_ = 0.02;
  for (int i = 6; i < 12; ++i) push(1.0 + 0.1 * i);
  EXPECT_TRUE(statusOf(0).lost_since.isZero());
  EXPECT_GT(dropped(drop::kLost), 4u) << "a single match should not be enough";
  EXPECT_GT(fused(), 2u);
  pushColour(2.15, "camera");
  EXPECT_EQ(host_->colour.counts().fused, 1u);
  expectAccounted();
}

TEST_F(PosesTest, TrackingContinuesWhenStampsGoBack) {
  start(PoseMode::kTrack);
  for (int i = 0; i < 5; ++i) push(100.0 + 0.1 * i);
  push(3.0);
  push(3.1);
  EXPECT_EQ(fused(), 7u);
  EXPECT_TRUE(statusOf(0).lost_since.isZero());
}

TEST_F(PosesTest, TrackingContinuesAfterTheMapIsCleared) {
  start(PoseMode::kTrack);
  push(1.0);
  camera_x_m_ = 0.08;
  push(1.1);
  host_->map.clear();
  EXPECT_TRUE(poses_->fusedPoses().empty());
  push(1.2);
  EXPECT_EQ(fused(), 3u);
  EXPECT_NEAR(foundX_m(), 0.08, 1e-9);
}

TEST_F(PosesTest, ACameraMustBeFoundInALoadedMap) {
  start(PoseMode::kTrack);
  push(1.0);
  auto loaded = std::make_unique<FakeMapper>(*mapper_);
  loaded->frames = 10;
  camera_x_m_ = 7.0;
  mapper_ = loaded.get();
  host_->map.replace(std::move(loaded), {}, "map.dtsdf", MapContents());
  push(1.1);
  EXPECT_EQ(dropped(drop::kLost), 1u);
  EXPECT_FALSE(statusOf(0).lost_since.isZero());
  poses_->setPose(Isometry3d(Eigen::Translation3d(7.02, 0.0, 0.0)));
  push(1.2);
  EXPECT_EQ(fused(), 2u);
  EXPECT_NEAR(foundX_m(), 7.0, 1e-9);
}

TEST_F(PosesTest, TheBaseStartsAtTheOrigin) {
  params_.base_frame = "base";
  start(PoseMode::kTrack);
  push(1.0);
  EXPECT_EQ(dropped(drop::kNoTransform), 1u);
  putTransform(host_->transforms, 1.0, 0.4, "camera", "base");
  camera_x_m_ = 0.45;
  push(1.1);
  EXPECT_EQ(fused(), 1u);
  EXPECT_NEAR(foundX_m(), 0.0, 1e-9);
  push(1.2);
  EXPECT_EQ(poses_->published()->child_frame_id, "base");
  EXPECT_NEAR(foundX_m(), 0.05, 1e-9);
  EXPECT_NEAR(poses_->fusedPoses().back().T_W_C.translation().x(), 0.45, 1e-9);
  putTransform(host_->transforms, 1.0, 0.3, "colour", "base");
  pushColour(1.25, "colour");
  EXPECT_EQ(host_->colour.counts().fused, 1u);
  pushColour(1.26, "elsewhere");
  EXPECT_EQ(host_->colour.counts().dropped_by[drop::kNoTransform], 1u);
  expectAccounted();
}

TEST_F(PosesTest, TheOldestPosesAreDiscarded) {
  start(PoseMode::kRefine);
  constexpr size_t most = 360000;
  PosedFrame frame;
  frame.frame_id = "camera";
  frame.image = DepthFrame();
  for (size_t i = 0; i < most + 2; ++i) {
    frame.stamp = ros::Time(1.0 + static_cast<double>(i));
    poses_->fused(frame, IntegrationResult());
  }
  EXPECT_EQ(poses_->fusedPoses().size(), most);
  EXPECT_EQ(poses_->fusedPoses().front().stamp_s, 3.0);
}

using Eigen::Matrix3d;

constexpr double kSigma_m = 0.05, kSigma_rad = 0.035;

/// An alignment that does not determine the shift along `axis`. That shift has a standard deviation
/// of kSigma_m. All other standard deviations are 1 mm or 1 mrad.
Alignment slidingAlong(const Vector3d& axis) {
  Alignment alignment;
  alignment.status = AlignmentStatus::kAligned;
  alignment.covariance.diagonal().setConstant(1e-6);
  alignment.covariance.topLeftCorner<3, 3>() += kSigma_m * kSigma_m * axis * axis.transpose();
  return alignment;
}

TEST(PoseCovariance, UnobservedAxesAreFree) {
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

TEST(PoseCovariance, TrackedPosesAreUncertainAlongFreeAxes) {
  const Vector3d along = Vector3d(3.0, 4.0, 0.0) / 5.0;
  PoseParams params;
  params.mode = PoseMode::kTrack;
  const Matrix6d tracked = odometryCovariance(slidingAlong(along), params);
  const Matrix3d shifts = tracked.topLeftCorner<3, 3>();
  EXPECT_GT(along.dot(shifts * along), 100.0);
  EXPECT_LT(Vector3d::UnitZ().dot(shifts * Vector3d::UnitZ()), 1e-5);
  EXPECT_TRUE(tracked.isApprox(tracked.transpose()));
  params.mode = PoseMode::kRefine;  // errors in poses from TF do not accumulate
  EXPECT_EQ(odometryCovariance(slidingAlong(along), params), slidingAlong(along).covariance);
  Alignment first;
  first.covariance.diagonal().setConstant(kSigma_m * kSigma_m);
  params.mode = PoseMode::kTrack;
  EXPECT_EQ(odometryCovariance(first, params), first.covariance);
}

/// Expects the covariance of the same pose error, computed for another point on the rigid body.
TEST(PoseCovariance, ErrorsMoveWithTheBody) {
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
