/// Tests how closely refined poses follow alignments, depending on the noise in input poses and
/// alignments.
#include "dtsdf_mapping/alignment_gain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace dtsdf {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// The true pose of a hand-held camera when an image is taken.
Isometry3d truthAt(int image) {
  const double t = 0.1 * image;
  Isometry3d T = Isometry3d::Identity();
  T.translation() = Vector3d(0.5 * std::sin(t), 0.3 * std::cos(0.7 * t), 0.2 * t);
  T.linear() = Eigen::AngleAxisd(0.4 * std::sin(0.5 * t), Vector3d::UnitY()).toRotationMatrix();
  return T;
}

class Noise {
 public:
  Noise(double sigma, unsigned seed) : sigma_(sigma), engine_(seed) {}

  /// Adds noise to a pose: a shift in metres and a rotation in radians, about each axis.
  Isometry3d operator()(const Isometry3d& pose) {
    Isometry3d noisy = pose;
    noisy.translation() += vector();
    const Vector3d turn = vector();
    if (turn.norm() > 0.0) {
      noisy.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * noisy.linear();
    }
    return noisy;
  }

 private:
  Vector3d vector() {
    return sigma_ * Vector3d(normal_(engine_), normal_(engine_), normal_(engine_));
  }

  double sigma_;
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

/// The gain after `images` images with independent errors in input poses and alignments.
AlignmentGain after(int images, double given_sigma, double aligned_sigma) {
  AlignmentGain gain;
  Noise given(given_sigma, 7), aligned(aligned_sigma, 8);
  for (int i = 0; i < images; ++i) {
    gain.addGiven(given(truthAt(i)));
    gain.addAligned(aligned(truthAt(i)));
  }
  return gain;
}

double shareOfStep(const AlignmentGain& gain, double step_m) {
  Isometry3d aligned = truthAt(0);
  aligned.translation() += Vector3d(0.0, step_m, 0.0);
  return gain.share(truthAt(0), aligned);
}

TEST(AlignmentGain, FollowsAlignmentsFullyIfPosesAreNoisy) {
  EXPECT_EQ(shareOfStep(after(100, 0.02, 0.001), 0.01), 1.0);
  EXPECT_EQ(shareOfStep(after(100, 0.02, 0.01), 0.01), 1.0);
}

/// The expected gain, 2^2 / (2^2 + 20^2) = 0.01, is that of a Kalman filter with noise of 2 mm and
/// 20 mm.
TEST(AlignmentGain, FollowsNoisyAlignmentsSlowlyIfPosesAreSmooth) {
  const double share = shareOfStep(after(100, 0.002, 0.02), 0.01);
  EXPECT_GT(share, 0.0);
  EXPECT_NEAR(share, 0.01, 0.02);
}

/// With noise of 10 mm per axis, steps of up to 3 sqrt(3) 10 mm = 52 mm count as noise.
TEST(AlignmentGain, FollowsStepsLargerThanNoise) {
  const AlignmentGain gain = after(200, 0.0, 0.01);
  EXPECT_LT(shareOfStep(gain, 0.03), 0.05);
  EXPECT_NEAR(shareOfStep(gain, 0.20), 1.0 - 0.052 / 0.20, 0.1);
}

/// A smooth error in the odometry, which alignments correct, does not count as noise in the
/// alignments.
TEST(AlignmentGain, FollowsExactAlignmentsIfOdometryDriftsSmoothly) {
  AlignmentGain gain;
  for (int i = 0; i < 100; ++i) {
    Isometry3d given = truthAt(i);
    given.translation() += Vector3d(0.02 * std::sin(0.2 * i), 0.0, 0.0);
    gain.addGiven(given);
    gain.addAligned(truthAt(i));
  }
  EXPECT_EQ(shareOfStep(gain, 0.01), 1.0);
}

/// A jump in the odometry says nothing about the noise in alignments.
TEST(AlignmentGain, RestartsWhenTheCorrectionJumps) {
  AlignmentGain gain;
  Noise given(0.001, 7), aligned(0.01, 8);
  for (int i = 0; i < 100; ++i) {
    gain.addGiven(given(truthAt(i)));
    EXPECT_FALSE(gain.addAligned(aligned(truthAt(i)))) << i;
  }
  EXPECT_LT(shareOfStep(gain, 0.01), 0.1);
  Isometry3d far = truthAt(100);
  far.translation() += Vector3d(0.3, 0.0, 0.0);
  gain.addGiven(far);
  EXPECT_TRUE(gain.addAligned(truthAt(100)));
  EXPECT_EQ(shareOfStep(gain, 0.01), 1.0);
}

TEST(AlignmentGain, FollowsAlignmentsFullyAtFirst) {
  EXPECT_EQ(shareOfStep(after(10, 0.002, 0.02), 0.01), 1.0);
  EXPECT_LT(shareOfStep(after(20, 0.002, 0.02), 0.01), 0.1);
}

}  // namespace
}  // namespace dtsdf
