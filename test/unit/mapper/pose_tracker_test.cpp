// Tests tracking a camera through analytic scenes, in a map built from the camera's own images.
#include "dtsdf_mapping/pose_tracker.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/fake_mapper.h"
#include "support/pose_distance.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kPeriod_s = 1.0 / 30.0;

Scene furnishedRoom() {
  Scene scene;
  scene.add(Room{Eigen::Vector3d(-2.0, -1.5, 0.0), Eigen::Vector3d(2.0, 1.5, 2.4)});
  scene.add(makeBox({1.2, 0.3, 0.4}, {0.8, 0.6, 0.8}, 0.4));
  scene.add(makeBox({1.6, -0.9, 0.9}, {0.4, 0.5, 1.8}));
  scene.add(Sphere{{0.9, 0.9, 1.0}, 0.3});
  scene.add(Sphere{{0.6, -0.6, 0.3}, 0.3});
  return scene;
}

/// The path of a hand-held camera: about 0.3 m/s and up to 20 degrees per second.
Isometry3d handAt(double time_s) {
  const Vector3d eye(-1.2 + 0.25 * std::sin(1.1 * time_s), 0.3 * std::sin(0.9 * time_s), 1.3);
  Isometry3d T_W_C = lookAt(eye, {1.2, 0.3 * std::sin(0.7 * time_s), 0.7}, Vector3d::UnitZ());
  T_W_C.rotate(AngleAxisd(0.2 * std::sin(1.3 * time_s), Vector3d::UnitZ()));
  return T_W_C;
}

/// A tracker and a map that fuses the tracked frames, as in a program.
class Tracking {
 public:
  explicit Tracking(const PoseParams& params = {}) : session_(makeCpuParams()), tracker_(params) {}

  /// Tracks an image taken at `truth`. @param given The input pose.
  Alignment see(const Scene& scene, const Isometry3d& truth, double stamp_s,
                const Isometry3d& given = Isometry3d::Identity()) {
    return take(renderFrame(scene, truth, 320, 240), stamp_s, given);
  }

  /// Tracks an image without measurements, as if the lens were covered.
  Alignment seeNothing(double stamp_s) {
    SceneFrame image = renderFrame(Scene(), Isometry3d::Identity(), 320, 240);
    return take(image, stamp_s, Isometry3d::Identity());
  }

  PoseTracker& tracker() { return tracker_; }
  size_t fused() const { return fused_; }

 private:
  Alignment take(const SceneFrame& image, double stamp_s, const Isometry3d& given) {
    DepthFrame frame = image.view();
    frame.T_W_C = given;
    const Alignment found = tracker_.track(session_.mapper(), frame, stamp_s);
    if (!tracker_.shouldFuse(found)) return found;
    frame.T_W_C = found.T_W_C;
    fused_ += session_.mapper().integrate(frame).status == FrameStatus::kFused ? 1 : 0;
    return found;
  }

  Session session_;
  PoseTracker tracker_;
  size_t fused_ = 0;
};

/// Tracks the hand-held camera for `frames` frames. Only the first frame has an input pose.
void follow(Tracking& tracking, const Scene& scene, int frames) {
  for (int i = 0; i < frames; ++i) {
    const double time_s = kPeriod_s * i;
    const Alignment found =
        tracking.see(scene, handAt(time_s), time_s, i == 0 ? handAt(0.0) : Isometry3d::Identity());
    ASSERT_TRUE(tracking.tracker().shouldFuse(found)) << i;
    ASSERT_LT(shiftBetween_m(found.T_W_C, handAt(time_s)), 5e-3) << i;
    ASSERT_LT(turnBetween_rad(found.T_W_C, handAt(time_s)), 4e-3) << i;
  }
}

TEST(PoseTracker, UsesOnlyTheFirstGivenPose) {
  Tracking tracking;
  follow(tracking, furnishedRoom(), 60);
  EXPECT_EQ(tracking.fused(), 60u);
  const double next_s = 60 * kPeriod_s;
  const auto expected = tracking.tracker().poseAt(next_s);
  ASSERT_TRUE(expected);
  EXPECT_LT(shiftBetween_m(*expected, handAt(next_s)), 5e-3) << "the pose should be extrapolated";
}

/// The camera accelerates sideways to 0.2 m per image.
TEST(PoseTracker, ExtrapolatesAcrossOneMissingImage) {
  constexpr int kImages = 9;
  const auto poseAt = [](int image) {
    const Vector3d eye(-1.2, -0.5 + 0.0125 * image * (image + 1), 1.3);
    return lookAt(eye, eye + Vector3d(2.4, 0.0, -0.6), Vector3d::UnitZ());
  };
  Tracking tracking;
  for (int i = 0; i < kImages; ++i) {
    const Alignment found = tracking.see(furnishedRoom(), poseAt(i), kPeriod_s * i, poseAt(0));
    ASSERT_TRUE(tracking.tracker().shouldFuse(found)) << i;
    ASSERT_LT(shiftBetween_m(found.T_W_C, poseAt(i)), 5e-3) << i;
  }
  const Isometry3d last = *tracking.tracker().lastPose();
  const double step_m = shiftBetween_m(last, poseAt(kImages - 2));
  ASSERT_NEAR(step_m, 0.2, 0.01);
  const auto aheadAt = [&](double periods) {
    const double stamp_s = kPeriod_s * (kImages - 1 + periods);
    return shiftBetween_m(last, *tracking.tracker().poseAt(stamp_s));
  };
  for (const double periods : {1.95, 2.0, 2.1}) {
    EXPECT_NEAR(aheadAt(periods), periods * step_m, 5e-3) << periods;
  }
  EXPECT_EQ(aheadAt(3.0), 0.0);
}

/// How far the camera moves during two seconds in the dark.
struct Movement {
  Vector3d shift_m;
  double turn_rad;
};

class AfterTheDark : public testing::TestWithParam<Movement> {};

TEST_P(AfterTheDark, TheCameraIsFoundAgainNearby) {
  const Scene scene = furnishedRoom();
  Tracking tracking;
  follow(tracking, scene, 30);
  const double dark_s = 30 * kPeriod_s;
  int frame = 30;
  for (; frame < 90; ++frame) {
    const Alignment found = tracking.seeNothing(kPeriod_s * frame);
    EXPECT_FALSE(tracking.tracker().shouldFuse(found));
    EXPECT_FALSE(tracking.tracker().poseAt(kPeriod_s * frame));
  }
  EXPECT_EQ(tracking.fused(), 30u);
  ASSERT_TRUE(tracking.tracker().lostSince_s());
  EXPECT_NEAR(*tracking.tracker().lostSince_s(), dark_s, 1e-9);

  Isometry3d truth = handAt(dark_s);
  truth.translation() += GetParam().shift_m;
  truth.rotate(AngleAxisd(GetParam().turn_rad, Vector3d::UnitY()));
  int unsure = 0;
  Alignment found;
  for (const int last = frame + 12; frame < last; ++frame) {
    found = tracking.see(scene, truth, kPeriod_s * frame);
    unsure += found.status == AlignmentStatus::kUnsure;
    if (tracking.tracker().shouldFuse(found)) {
      EXPECT_LT(shiftBetween_m(found.T_W_C, truth), 4e-3);
      EXPECT_LT(turnBetween_rad(found.T_W_C, truth), 4e-3);
    }
  }
  EXPECT_EQ(found.status, AlignmentStatus::kAligned);
  EXPECT_FALSE(tracking.tracker().isLost());
  EXPECT_GE(unsure, 2) << "one image should not be enough";
  EXPECT_GT(tracking.fused(), 30u);
}

INSTANTIATE_TEST_SUITE_P(Away, AfterTheDark,
                         testing::Values(Movement{{0.06, -0.04, 0.03}, 0.08},
                                         Movement{{0.02, 0.0, 0.0}, 0.25},
                                         Movement{{-0.2, 0.0, 0.0}, 0.0}));

/// After an image without measurements, the camera is in another room. Images of that room must not
/// be fused.
TEST(PoseTracker, NeverFusesImagesOfAnotherPlace) {
  Tracking tracking;
  follow(tracking, furnishedRoom(), 30);
  Scene other;
  for (int i = 0; i < 12; ++i) {
    for (int k = 0; k < 8; ++k) other.add(Sphere{{1.5, 0.3 * i - 1.6, 0.3 * k}, 0.13});
  }
  tracking.seeNothing(30 * kPeriod_s);
  for (int frame = 31; frame < 61; ++frame) {
    const Alignment found = tracking.see(other, handAt(kPeriod_s * frame), kPeriod_s * frame);
    EXPECT_FALSE(tracking.tracker().shouldFuse(found)) << frame;
  }
  EXPECT_EQ(tracking.fused(), 30u);
  EXPECT_TRUE(tracking.tracker().isLost());
}

TEST(PoseTracker, ResumesFromASetPose) {
  const Scene scene = furnishedRoom();
  Tracking tracking;
  follow(tracking, scene, 30);
  tracking.seeNothing(30 * kPeriod_s);
  EXPECT_TRUE(tracking.tracker().isLost());
  const Isometry3d truth = lookAt({-0.5, 0.9, 1.5}, {1.2, -0.3, 0.5}, Vector3d::UnitZ());
  Isometry3d about = truth;
  about.translation() += Vector3d(0.03, 0.02, -0.02);
  tracking.tracker().setPose(about);
  const Alignment found = tracking.see(scene, truth, 31 * kPeriod_s);
  EXPECT_TRUE(tracking.tracker().shouldFuse(found));
  EXPECT_LT(shiftBetween_m(found.T_W_C, truth), 5e-3);
}

/// Too few points fit the pose found for the first image, so the tracker rejects this pose. It then
/// searches around the pose that was set.
TEST(PoseTracker, SearchesAroundASetPose) {
  FakeMapper mapper;
  mapper.integrate(DepthFrame());
  std::vector<Isometry3d> tried;
  mapper.aligns = [&](const DepthFrame& frame) {
    tried.push_back(frame.T_W_C);
    Alignment slid;
    slid.status = AlignmentStatus::kAligned;
    slid.T_W_C = frame.T_W_C * Eigen::Translation3d(0.1, 0.0, 0.0);
    return slid;
  };
  PoseTracker tracker{PoseParams()};
  tracker.setPose(handAt(0.0));
  EXPECT_EQ(tracker.track(mapper, DepthFrame(), 0.0).status, AlignmentStatus::kMisfit);
  EXPECT_TRUE(tracker.lastPose()->isApprox(handAt(0.0)));
  tracker.track(mapper, DepthFrame(), kPeriod_s);
  ASSERT_GT(tried.size(), 1u);
  EXPECT_TRUE(tried[1].isApprox(handAt(0.0))) << "the search should begin at the set pose";
}

/// In a loaded map, the camera may be anywhere. The step from the initial guess to the pose that
/// was found must not count as motion.
TEST(PoseTracker, FusesNothingUntilLocalised) {
  const Scene scene = furnishedRoom();
  Tracking tracking;
  follow(tracking, scene, 30);
  const Isometry3d truth = handAt(30 * kPeriod_s);
  Isometry3d near = truth;
  near.translation() += Vector3d(0.05, -0.04, 0.03);
  tracking.tracker().seek(near, 31 * kPeriod_s);
  EXPECT_TRUE(tracking.tracker().isLost());
  EXPECT_FALSE(tracking.tracker().poseAt(31 * kPeriod_s));
  EXPECT_LT(shiftBetween_m(*tracking.tracker().lastPose(), near), 1e-12);
  for (int i = 0; i < 3; ++i) {
    const Alignment found = tracking.see(scene, truth, (31 + i) * kPeriod_s);
    EXPECT_EQ(tracking.tracker().shouldFuse(found), i == 2) << i;
    EXPECT_LT(shiftBetween_m(found.T_W_C, truth), 4e-3) << i;
  }
  EXPECT_FALSE(tracking.tracker().isLost());
  EXPECT_LT(shiftBetween_m(*tracking.tracker().poseAt(34 * kPeriod_s), truth), 5e-3);
}

/// After two seconds in the dark, the camera is far from all its earlier poses.
TEST(PoseTracker, FindsALostCameraAnywhereInTheMap) {
  const Scene scene = furnishedRoom();
  Tracking tracking;
  follow(tracking, scene, 30);
  for (const double stamp_s : {2.0, 3.0, 3.9}) tracking.seeNothing(stamp_s);
  Isometry3d truth = lookAt({-0.9, 0.5, 1.6}, {1.2, -0.2, 0.6}, Vector3d::UnitZ());
  truth.rotate(AngleAxisd(1.2, Vector3d::UnitZ()));
  int image = 0;
  for (; image < 40 && tracking.tracker().isLost(); ++image) {
    const Alignment found = tracking.see(scene, truth, 4.1 + kPeriod_s * image);
    if (tracking.tracker().shouldFuse(found)) {
      EXPECT_LT(shiftBetween_m(found.T_W_C, truth), 5e-3);
    }
  }
  EXPECT_FALSE(tracking.tracker().isLost());
  EXPECT_GE(image, 3) << "three images should have to agree";
}

/// Frames without measurements do not start a map; the next frame with measurements does.
TEST(PoseTracker, StartsAtTheFirstNonEmptyImage) {
  const Scene scene = furnishedRoom();
  Tracking tracking;
  tracking.seeNothing(0.0);
  for (int i = 1; i < 10; ++i) tracking.see(scene, handAt(0.0), kPeriod_s * i);
  EXPECT_EQ(tracking.fused(), 9u);
  const std::optional<Isometry3d> T_W_C = tracking.tracker().poseAt(10 * kPeriod_s);
  ASSERT_TRUE(T_W_C);
  EXPECT_LT(shiftBetween_m(*T_W_C, Isometry3d::Identity()), 2e-3);
}

/// Only the first image has an input pose. The second image shows an unmapped place, so its pose is
/// unknown.
TEST(PoseTracker, DoesNotFuseAnUnmappedSecondImage) {
  Scene near, far;
  near.add(Plane{{1.0, 0.0, 0.0}, -Vector3d::UnitX()});
  far.add(Plane{{3.0, 0.0, 0.0}, -Vector3d::UnitX()});
  const Isometry3d T_W_C = lookAt({0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, Vector3d::UnitZ());
  Tracking tracking;
  tracking.see(near, T_W_C, 0.0, T_W_C);
  ASSERT_EQ(tracking.fused(), 1u);
  const Alignment found = tracking.see(far, T_W_C, kPeriod_s);
  EXPECT_EQ(found.status, AlignmentStatus::kUnmapped);
  EXPECT_FALSE(tracking.tracker().shouldFuse(found));
  EXPECT_TRUE(tracking.tracker().isLost());
  EXPECT_EQ(tracking.fused(), 1u);
}

/// Walls and floor constrain five of the six degrees of freedom. The pose may drift along the
/// corridor, and the covariance must show this.
TEST(PoseTracker, ACorridorLeavesItsAxisUnconstrained) {
  Scene corridor;
  corridor.add(Plane{{0.0, 1.0, 0.0}, -Vector3d::UnitY()});
  corridor.add(Plane{{0.0, -1.0, 0.0}, Vector3d::UnitY()});
  corridor.add(Plane{{0.0, 0.0, 0.0}, Vector3d::UnitZ()});
  const PoseParams params;
  Tracking tracking(params);
  for (int i = 0; i < 30; ++i) {
    const Vector3d eye(0.01 * i, 0.05 * std::sin(0.3 * i), 1.2);
    const Isometry3d truth = lookAt(eye, eye + Vector3d(1.0, 0.2, -0.3), Vector3d::UnitZ());
    const Alignment found = tracking.see(corridor, truth, kPeriod_s * i, truth);
    ASSERT_TRUE(tracking.tracker().shouldFuse(found)) << i;
    if (found.status != AlignmentStatus::kAligned) continue;
    const Vector3d error = found.T_W_C.translation() - truth.translation();
    EXPECT_LT(error.tail<2>().norm(), 3e-3) << i;
    EXPECT_LT(turnBetween_rad(found.T_W_C, truth), 3e-3) << i;
    EXPECT_GT(std::sqrt(found.covariance(0, 0)), 0.5 * params.sigma_m);
    for (const int held : {1, 2}) {
      EXPECT_LT(std::sqrt(found.covariance(held, held)), 0.1 * params.sigma_m);
    }
  }
}

}  // namespace
}  // namespace dtsdf
