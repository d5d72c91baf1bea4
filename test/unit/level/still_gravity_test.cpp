// Tests the up vector computed from accelerometer samples while the sensor is held still.
#include "level/still_gravity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace dtsdf {
namespace {

using Eigen::Vector3d;

const Vector3d kUp = Vector3d(0.3, -0.9, 0.2).normalized();
constexpr double kGravity = 9.80665;

/// Adds samples at rate_hz and returns the last result.
std::optional<Vector3d> feed(StillGravity& gravity, double from_s, double seconds, double rate_hz,
                             const Vector3d& acceleration) {
  std::optional<Vector3d> up;
  const int count = static_cast<int>(std::lround(seconds * rate_hz));
  for (int i = 0; i <= count; ++i) up = gravity.add({from_s + i / rate_hz, acceleration, {}});
  return up;
}

TEST(StillGravity, IsTheMeanOfAStillSecond) {
  StillGravity gravity;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.05);
  const auto noisySample = [&](double stamp_s) {
    const Vector3d n(noise(random), noise(random), noise(random));
    return InertialSample{stamp_s, kGravity * kUp + n, Vector3d(0.01, 0.0, 0.02)};
  };
  for (int i = 0; i < 200; ++i) {
    EXPECT_FALSE(gravity.add(noisySample(100.0 + i / 200.0))) << i;
  }
  const std::optional<Vector3d> up = gravity.add(noisySample(101.0));
  ASSERT_TRUE(up);
  EXPECT_NEAR(up->norm(), 1.0, 1e-12);
  EXPECT_LT(std::acos(std::min(1.0, up->dot(kUp))), 0.002);
}

TEST(StillGravity, NeedsEnoughSamples) {
  StillGravity gravity;
  EXPECT_FALSE(feed(gravity, 0.0, 5.0, 10.0, kGravity * kUp));
  EXPECT_TRUE(feed(gravity, 10.0, 1.5, 50.0, kGravity * kUp));
}

TEST(StillGravity, IsFoundAtAHighRate) {
  StillGravity gravity;
  bool is_found = false;
  for (int i = 0; i < 30000; ++i) {
    is_found = gravity.add({i / 20000.0, kGravity * kUp, {}}) || is_found;
  }
  EXPECT_TRUE(is_found);
}

TEST(StillGravity, IsNotFoundInMotion) {
  StillGravity shaken;
  std::optional<Vector3d> up;
  for (int i = 0; i < 400; ++i) {
    const double t = i / 200.0;
    up = shaken.add({t, kGravity * kUp + Vector3d(std::sin(20.0 * t), 0.0, 0.0), {}});
    EXPECT_FALSE(up);
  }
  EXPECT_TRUE(feed(shaken, 2.0, 1.5, 200.0, kGravity * kUp));

  StillGravity turning;
  for (int i = 0; i < 400; ++i) {
    EXPECT_FALSE(turning.add({i / 200.0, kGravity * kUp, Vector3d(0.0, 0.0, 0.3)}));
  }
}

TEST(StillGravity, RejectsImplausibleMagnitudes) {
  StillGravity in_g, falling;
  EXPECT_FALSE(feed(in_g, 0.0, 2.0, 100.0, kUp)) << "values in units of g should be rejected";
  EXPECT_FALSE(feed(falling, 0.0, 2.0, 100.0, Vector3d::Zero()));
}

TEST(StillGravity, SkipsNonFiniteSamplesAndHandlesRestarts) {
  StillGravity gravity;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(feed(gravity, 50.0, 2.0, 100.0, kGravity * kUp));
  EXPECT_FALSE(gravity.add({52.01, Vector3d(nan, 0.0, 0.0), {}}));
  EXPECT_FALSE(gravity.add({nan, kGravity * kUp, {}}));
  EXPECT_TRUE(gravity.add({52.02, kGravity * kUp, {}}));
  EXPECT_FALSE(gravity.add({10.0, kGravity * kUp, {}}));
  EXPECT_TRUE(feed(gravity, 10.0, 1.1, 100.0, kGravity * kUp));
}

}  // namespace
}  // namespace dtsdf
