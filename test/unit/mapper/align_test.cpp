// Tests the alignment of images to maps of analytic scenes, starting from poses with known errors.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "dtsdf_mapping/pose_refiner.h"
#include "support/map_equality.h"
#include "support/pose_distance.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Two walls and the floor in a corner of a room.
Scene corner() {
  Scene scene;
  scene.add(Plane{{2.0, 0.0, 0.0}, -Vector3d::UnitX()});
  scene.add(Plane{{0.0, 2.0, 0.0}, -Vector3d::UnitY()});
  scene.add(Plane{{0.0, 0.0, -1.0}, Vector3d::UnitZ()});
  return scene;
}

Scene wall() {
  Scene scene;
  scene.add(Plane{{2.0, 0.0, 0.0}, -Vector3d::UnitX()});
  return scene;
}

Isometry3d cornerPose() { return lookAt({0.3, 0.2, 0.1}, {2.0, 2.0, -1.0}, Vector3d::UnitZ()); }
Isometry3d wallPose() { return lookAt({0.3, 0.2, 0.1}, {2.0, 0.2, 0.1}, Vector3d::UnitZ()); }

/// Fuses three frames of a scene, all from one pose.
void mapFrom(Session& session, const Scene& scene, const Isometry3d& T_W_C) {
  for (int i = 0; i < 3; ++i) session.integrate(renderFrame(scene, T_W_C, 320, 240));
}

Isometry3d off(const Isometry3d& T_W_C, const Vector3d& shift_m, double turn_deg) {
  Isometry3d moved = T_W_C;
  moved.translation() += shift_m;
  moved.linear() =
      AngleAxisd(turn_deg * M_PI / 180.0, Vector3d(1.0, -2.0, 1.5).normalized()) * T_W_C.linear();
  return moved;
}

/// The pose found for an image taken at `truth` if the input pose is `given`.
Alignment alignAt(Session& session, const Scene& scene, const Isometry3d& truth,
                  const Isometry3d& given, const PosePrior& prior = {0.1, 0.15}) {
  const SceneFrame image = renderFrame(scene, truth, 320, 240);
  DepthFrame frame = image.view();
  frame.T_W_C = given;
  return session.mapper().align(frame, prior);
}

struct Offset {
  Vector3d shift_m;
  double turn_deg;
};

/// With 20 mm voxels, the map itself is off by about 0.2 mm. All input poses must lead to the same
/// result.
class Corner : public testing::TestWithParam<Offset> {};

TEST_P(Corner, DeterminesThePose) {
  Session session(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  const Isometry3d given = off(cornerPose(), GetParam().shift_m, GetParam().turn_deg);
  const Alignment found = alignAt(session, corner(), cornerPose(), given);
  ASSERT_EQ(found.status, AlignmentStatus::kAligned);
  EXPECT_LT((found.T_W_C.translation() - cornerPose().translation()).norm(), 0.5e-3);
  EXPECT_LT(turnBetween_rad(found.T_W_C, cornerPose()), 0.5e-3);
  EXPECT_NEAR(found.shift_m, (found.T_W_C.translation() - given.translation()).norm(), 1e-9);
  EXPECT_GT(found.inlier_share, 0.9);
  EXPECT_TRUE(found.is_held);
  EXPECT_LT(found.residual_m, 0.002);
  const Alignment from_truth = alignAt(session, corner(), cornerPose(), cornerPose());
  EXPECT_LT((found.T_W_C.translation() - from_truth.T_W_C.translation()).norm(), 0.1e-3);
  EXPECT_LT(turnBetween_rad(found.T_W_C, from_truth.T_W_C), 0.1e-3);
}

/// Shifts of 10 cm towards each corner of a cube, combined with rotations of 8 degrees in either
/// direction.
std::vector<Offset> farOffsets() {
  std::vector<Offset> offsets;
  for (int i = 0; i < 16; ++i) {
    const Vector3d towards((i & 1) ? 1.0 : -1.0, (i & 2) ? 1.0 : -1.0, (i & 4) ? 1.0 : -1.0);
    offsets.push_back({0.1 * towards.normalized(), (i & 8) ? 8.0 : -8.0});
  }
  return offsets;
}

INSTANTIATE_TEST_SUITE_P(FromFar, Corner, testing::ValuesIn(farOffsets()));

INSTANTIATE_TEST_SUITE_P(
    From, Corner,
    testing::Values(Offset{{0.0, 0.0, 0.0}, 0.0}, Offset{{0.03, -0.02, 0.01}, 0.0},
                    Offset{{0.0, 0.0, 0.0}, 2.0}, Offset{{-0.05, 0.03, 0.04}, -3.0},
                    Offset{{0.06, 0.06, -0.05}, 4.0}, Offset{{-0.06, 0.06, 0.053}, 0.0},
                    Offset{{0.0, 0.0, 0.0}, 8.0}, Offset{{0.0, 0.0, 0.0}, -8.0}));

/// A wall does not constrain shifts along it or rotations about its normal. Such errors stay; all
/// others are corrected.
TEST(Align, AWallConstrainsThreeDegreesOfFreedom) {
  Session session(makeCpuParams());
  mapFrom(session, wall(), wallPose());
  const PosePrior prior{0.1, 0.15};
  const Alignment found =
      alignAt(session, wall(), wallPose(), off(wallPose(), {0.03, 0.04, -0.03}, 0.0), prior);
  ASSERT_EQ(found.status, AlignmentStatus::kAligned);
  const Vector3d error = found.T_W_C.translation() - wallPose().translation();
  EXPECT_NEAR(error.x(), 0.0, 1e-3);
  EXPECT_NEAR(error.y(), 0.04, 0.01);
  EXPECT_NEAR(error.z(), -0.03, 0.01);
  EXPECT_LT(std::sqrt(found.covariance(0, 0)), 0.1 * prior.sigma_m);
  for (const int unconstrained : {1, 2}) {
    EXPECT_GT(std::sqrt(found.covariance(unconstrained, unconstrained)), 0.5 * prior.sigma_m);
  }
  EXPECT_GT(std::sqrt(found.covariance(3, 3)), 0.5 * prior.sigma_rad);  // about the wall's normal
  EXPECT_LT(std::sqrt(found.covariance(4, 4)), 0.1 * prior.sigma_rad);
}

/// A plate half a voxel thick, mapped from both sides. Images of each side must be aligned to that
/// side.
TEST(Align, DistinguishesTheSidesOfAPlate) {
  Scene plate;
  plate.add(Box{Isometry3d(Eigen::Translation3d(1.0, 0.0, 0.0)), {0.005, 0.4, 0.4}});
  const Isometry3d front = lookAt({0.0, 0.1, 0.1}, {1.0, 0.0, 0.0}, Vector3d::UnitZ());
  const Isometry3d back = lookAt({2.0, 0.1, 0.1}, {1.0, 0.0, 0.0}, Vector3d::UnitZ());
  Session session(makeCpuParams());
  for (int i = 0; i < 3; ++i) {
    session.integrate(renderFrame(plate, front, 320, 240));
    session.integrate(renderFrame(plate, back, 320, 240));
  }
  for (const Isometry3d& truth : {front, back}) {
    const Alignment found =
        alignAt(session, plate, truth, off(truth, {0.004, 0.0, 0.0}, 0.0), {0.02, 0.01});
    ASSERT_EQ(found.status, AlignmentStatus::kAligned);
    EXPECT_NEAR(found.T_W_C.translation().x(), truth.translation().x(), 1e-3);
  }
}

TEST(Align, AnEmptyMapLeavesThePoseUnchanged) {
  Session session(makeCpuParams());
  const Alignment found = alignAt(session, wall(), wallPose(), wallPose());
  EXPECT_EQ(found.status, AlignmentStatus::kUnmapped);
  EXPECT_TRUE(found.T_W_C.isApprox(wallPose(), 0.0));
  EXPECT_NEAR(found.covariance(0, 0), 0.01, 1e-12);
}

TEST(Align, AnotherPlaceDoesNotFit) {
  Session session(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  Scene other;  // balls close to the positions of the walls
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 10; ++k) other.add(Sphere{{1.9, 0.3 * i - 1.0, 0.3 * k - 1.5}, 0.12});
    for (int k = 0; k < 10; ++k) other.add(Sphere{{0.3 * i - 1.0, 1.9, 0.3 * k - 1.5}, 0.12});
  }
  const Alignment found = alignAt(session, other, cornerPose(), cornerPose());
  EXPECT_NE(found.status, AlignmentStatus::kAligned);
  EXPECT_FALSE(found.is_held);
  EXPECT_TRUE(found.T_W_C.isApprox(cornerPose(), 0.0));
}

TEST(Align, RefusesBadFramesAndLeavesTheMapUnchanged) {
  Session session(makeCpuParams()), untouched(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  mapFrom(untouched, corner(), cornerPose());
  alignAt(session, corner(), cornerPose(), off(cornerPose(), {0.02, 0.0, 0.0}, 1.0));
  const SceneFrame image = renderFrame(corner(), cornerPose());
  DepthFrame bad = image.view();
  bad.T_W_C.translation().x() = NAN;
  const Alignment refused = session.mapper().align(bad, {0.1, 0.2});
  EXPECT_EQ(refused.status, AlignmentStatus::kUnmapped);
  EXPECT_NEAR(refused.covariance(0, 0), 0.01, 1e-12);
  EXPECT_NEAR(refused.covariance(5, 5), 0.04, 1e-12);
  bad = image.view();
  bad.intrinsics.fx = 0.0f;
  EXPECT_EQ(session.mapper().align(bad, {}).status, AlignmentStatus::kUnmapped);
  EXPECT_TRUE(sameMaps(untouched.mapper(), session.mapper()));
}

/// All input poses have the same error, plus noise. Each image is corrected, and the filter learns
/// most of the common error, but little of the noise.
TEST(PoseRefiner, LearnsAConstantErrorButNotNoise) {
  Session session(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  PoseParams params;
  params.mode = PoseMode::kRefine;
  PoseRefiner refiner(params);
  const Vector3d constant(0.03, -0.02, 0.02), noise(0.02, 0.015, -0.02);
  for (int i = 0; i < 30; ++i) {
    Isometry3d truth = cornerPose();
    truth.translation() += 0.02 * i * Vector3d(0.3, 0.3, -0.1);
    const SceneFrame image = renderFrame(corner(), truth, 320, 240);
    DepthFrame frame = image.view();
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    frame.T_W_C = off(truth, constant + sign * noise, 0.5 * sign);
    const Alignment found = refiner.refine(session.mapper(), frame);
    ASSERT_EQ(found.status, AlignmentStatus::kAligned);
    // An uncorrected error is insignificant: it shifts no wall by more than 0.2 voxels (4 mm).
    const double least_m = found.is_significant ? 1e-3 : 0.2 * 0.02 * std::sqrt(3.0);
    EXPECT_LT((found.T_W_C.translation() - truth.translation()).norm(), least_m) << i;
    if (i < 10) continue;
    EXPECT_LT((refiner.T_W_O().translation() + constant).norm(), 0.3 * noise.norm()) << i;
  }
}

/// The odometry and the map have different origins.
TEST(PoseRefiner, LearnsTheOffsetOfTheOdometry) {
  Session session(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  PoseRefiner refiner{PoseParams()};
  const Vector3d offset(0.03, -0.02, 0.02);
  const SceneFrame image = renderFrame(corner(), cornerPose(), 320, 240);
  DepthFrame frame = image.view();
  frame.T_W_C.translation() += offset;
  for (int i = 0; i < 30; ++i) {
    const Alignment found = refiner.refine(session.mapper(), frame);
    ASSERT_EQ(found.status, AlignmentStatus::kAligned);
    // The remaining error is insignificant: it shifts no wall by more than 0.2 voxels (4 mm).
    EXPECT_LT((found.T_W_C.translation() - cornerPose().translation()).norm(), 0.0075) << i;
  }
  EXPECT_LT((refiner.T_W_O().translation() + offset).norm(), 0.0075);
}

/// The map's own error does not count as an error of the pose.
TEST(PoseRefiner, LeavesCorrectPosesUnchanged) {
  Session session(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  PoseRefiner refiner{PoseParams()};
  Isometry3d truth = cornerPose();
  truth.translation() += Vector3d(0.1, 0.05, -0.02);
  const SceneFrame image = renderFrame(corner(), truth, 320, 240);
  const Alignment found = refiner.refine(session.mapper(), image.view());
  ASSERT_EQ(found.status, AlignmentStatus::kAligned);
  EXPECT_FALSE(found.is_significant);
  EXPECT_LT(found.misplacement_m, 0.1 * 0.02);
  EXPECT_EQ(found.T_W_C.matrix(), truth.matrix());
  EXPECT_TRUE(refiner.T_W_O().isApprox(Isometry3d::Identity(), 1e-12));
}

/// An alignment that starts at the input pose ends centimetres off, but the image fits at the
/// previous pose.
TEST(PoseRefiner, AlsoTriesThePreviousPose) {
  Session session(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  PoseParams params;
  params.sigma_m = 0.1;
  params.sigma_rad = 0.15;
  const Isometry3d given = off(cornerPose(), {-0.06, 0.06, 0.06}, 12.0);
  const Alignment slipped = alignAt(session, corner(), cornerPose(), given);
  ASSERT_GT((slipped.T_W_C.translation() - cornerPose().translation()).norm(), 0.03);
  PoseRefiner refiner(params);
  const SceneFrame image = renderFrame(corner(), cornerPose(), 320, 240);
  DepthFrame frame = image.view();
  refiner.refine(session.mapper(), frame);
  frame.T_W_C = given;
  const Alignment found = refiner.refine(session.mapper(), frame);
  ASSERT_EQ(found.status, AlignmentStatus::kAligned);
  EXPECT_LT((found.T_W_C.translation() - cornerPose().translation()).norm(), 0.5e-3);
  EXPECT_NEAR(found.shift_m, (cornerPose().translation() - given.translation()).norm(), 1e-3);
}

/// The image fits at the previous pose, but that pose is too far from the input pose.
TEST(PoseRefiner, RejectsThePreviousPoseIfTooFar) {
  for (const double turn_deg : {20.0, 180.0}) {
    Session session(makeCpuParams());
    mapFrom(session, corner(), cornerPose());
    PoseRefiner refiner{PoseParams()};
    const SceneFrame image = renderFrame(corner(), cornerPose(), 320, 240);
    DepthFrame frame = image.view();
    ASSERT_EQ(refiner.refine(session.mapper(), frame).status, AlignmentStatus::kAligned);
    frame.T_W_C = off(cornerPose(), {0.3, 0.3, 0.3}, turn_deg);
    const Alignment found = refiner.refine(session.mapper(), frame);
    EXPECT_GT((found.T_W_C.translation() - cornerPose().translation()).norm(), 0.3) << turn_deg;
  }
}

/// Along the wall's normal, the standard deviation is the remaining error. Along the wall, it is
/// that of the input pose.
TEST(PoseRefiner, CovarianceIncludesUncorrectedErrors) {
  Session session(makeCpuParams());
  mapFrom(session, wall(), wallPose());
  const PoseParams params;
  PoseRefiner refiner(params);
  const double off_m = 0.003;  // 0.15 voxels
  const SceneFrame image = renderFrame(wall(), wallPose(), 320, 240);
  DepthFrame frame = image.view();
  frame.T_W_C.translation().x() += off_m;
  const Alignment found = refiner.refine(session.mapper(), frame);
  ASSERT_EQ(found.status, AlignmentStatus::kAligned);
  EXPECT_FALSE(found.is_significant);
  EXPECT_EQ(found.T_W_C.matrix(), frame.T_W_C.matrix());
  EXPECT_NEAR(std::sqrt(found.covariance(0, 0)), off_m, 0.1 * off_m);
  EXPECT_GE(std::sqrt(found.covariance(1, 1)), params.sigma_m);
}

/// Invalid poses have no effect, neither for the first image nor later.
TEST(PoseRefiner, IgnoresInvalidPoses) {
  Session session(makeCpuParams());
  mapFrom(session, corner(), cornerPose());
  PoseRefiner refiner{PoseParams()}, undisturbed{PoseParams()};
  const Vector3d offset(0.03, -0.02, 0.02);
  const SceneFrame image = renderFrame(corner(), cornerPose(), 320, 240);
  DepthFrame frame = image.view(), broken = image.view();
  frame.T_W_C.translation() += offset;
  broken.T_W_C.translation().y() = NAN;
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(refiner.refine(session.mapper(), broken).status, AlignmentStatus::kUnmapped);
    const Alignment found = refiner.refine(session.mapper(), frame);
    EXPECT_EQ(found.T_W_C.matrix(), undisturbed.refine(session.mapper(), frame).T_W_C.matrix());
  }
  EXPECT_EQ(refiner.T_W_O().matrix(), undisturbed.T_W_O().matrix());
}

/// Only the error towards the wall counts, not the error along it.
TEST(Align, ReportsTheMisplacement) {
  Session session(makeCpuParams());
  mapFrom(session, wall(), wallPose());
  const Vector3d shift_m(0.01, 0.02, 0.0);  // towards the wall, and along it
  const Alignment found =
      alignAt(session, wall(), wallPose(), off(wallPose(), shift_m, 0.0), {0.1, 0.001});
  ASSERT_EQ(found.status, AlignmentStatus::kAligned);
  EXPECT_TRUE(found.is_significant);
  EXPECT_NEAR(found.misplacement_m, 0.01, 0.0005);
}

TEST(PoseRefiner, DropsMisfitsOnRequest) {
  Alignment misfit;
  misfit.status = AlignmentStatus::kMisfit;
  Alignment unmapped;
  PoseParams params;
  EXPECT_TRUE(PoseRefiner(params).shouldFuse(misfit));
  params.drop_misfits = true;
  EXPECT_FALSE(PoseRefiner(params).shouldFuse(misfit));
  EXPECT_TRUE(PoseRefiner(params).shouldFuse(unmapped));
}

}  // namespace
}  // namespace dtsdf
