#include "evaluation/hand_path.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "evaluation/camera_views.h"

namespace dtsdf {
namespace {

constexpr double kRate_hz = 30.0;

std::vector<Eigen::Isometry3d> circle() { return orbitPoses(OrbitShape::kCircle, 40, 1.5); }

TEST(HandPath, MovesLikeAHand) {
  const auto poses_W_C = handPoses(circle(), {900, kRate_hz, 1});
  ASSERT_EQ(poses_W_C.size(), 900u);
  double fastest_m_s = 0.0, fastest_rad_s = 0.0, max_roll = 0.0, path_m = 0.0;
  for (size_t i = 0; i < poses_W_C.size(); ++i) {
    const Eigen::Isometry3d& T = poses_W_C[i];
    EXPECT_TRUE(T.linear().isUnitary(1e-9));
    EXPECT_NEAR(T.translation().norm(), 1.5, 0.3) << "the path should stay near the circle";
    max_roll = std::max(max_roll, std::abs(T.linear()(1, 0)));
    if (i == 0) continue;
    const Eigen::Isometry3d step = poses_W_C[i - 1].inverse() * T;
    path_m += step.translation().norm();
    fastest_m_s = std::max(fastest_m_s, kRate_hz * step.translation().norm());
    fastest_rad_s = std::max(fastest_rad_s, kRate_hz * Eigen::AngleAxisd(step.linear()).angle());
  }
  EXPECT_GT(path_m / 30.0, 0.4);
  EXPECT_LT(fastest_m_s, 1.2);
  EXPECT_GT(fastest_rad_s, 0.5);
  EXPECT_LT(fastest_rad_s, 2.0);
  EXPECT_GT(max_roll, 0.2);
}

TEST(HandPath, DependsOnTheSeedNotTheRate) {
  const auto once = handPoses(circle(), {20, kRate_hz, 7});
  const auto again = handPoses(circle(), {40, 2.0 * kRate_hz, 7});
  const auto other = handPoses(circle(), {20, kRate_hz, 8});
  for (size_t i = 0; i < once.size(); ++i) {
    EXPECT_TRUE(once[i].isApprox(again[2 * i], 1e-12));
    EXPECT_FALSE(once[i].isApprox(other[i], 1e-3));
  }
}

}  // namespace
}  // namespace dtsdf
