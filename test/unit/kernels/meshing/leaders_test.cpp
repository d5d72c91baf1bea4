#include "kernels/meshing/leaders.h"

#include <gtest/gtest.h>

#include <cmath>

#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace leaders_test {

/// Two edges along x: a rise of 0.5 by weights of 1 + 3, and one of 1 by 2 + 2: 0.75 on average.
/// Where a weight of 1 is too little, only the second counts.
TEST(Leaders, RiseIsTheWeightedMeanOverEdges) {
  UnitSamples samples = {};
  samples.corner[3][0] = {-0.25f, 1.0f};
  samples.corner[3][1] = {0.25f, 3.0f};
  samples.corner[3][2] = {0.0f, 2.0f};
  samples.corner[3][3] = {1.0f, 2.0f};
  EXPECT_EQ(riseAlong(samples, 3, 0, 0.0f), 0.75f);
  EXPECT_EQ(riseAlong(samples, 3, 0, 1.0f), 1.0f);
  EXPECT_EQ(riseAlong(samples, 3, 2, 0.0f), 0.0f);  // no edge along z is known
}

/// n = (0.6, 0, 0.8), eight corners of weight 2: X+ is confident by 16 * 0.6, Z+ by 16 * 0.8, and
/// the others are not, whatever the length of the gradient.
TEST(Leaders, ConfidenceIsWeightTimesCosine) {
  for (const double length : {1.0, 0.5}) {
    const UnitPlane plane{length * Eigen::Vector3d(0.6, 0.0, 0.8), length * 0.5};
    UnitSamples samples = {};
    for (int d = 0; d < kDirectionCount; ++d) addPlaneTo(samples, d, plane, 2.0f);
    const float expected[kDirectionCount] = {9.6f, 0.0f, 0.0f, 0.0f, 12.8f, 0.0f};
    for (int d = 0; d < kDirectionCount; ++d) {
      EXPECT_NEAR(directionConfidence(samples, d, 0.0f), expected[d], 1e-4f) << "direction " << d;
    }
  }
}

/// sin(pi/8) is 0.3827: a gradient with a cosine of 0.38 is out of X+, one with 0.39 is in.
TEST(Leaders, TheGradientHasToLieInTheDirectionsRange) {
  for (const double cosine : {0.38, 0.39}) {
    const Eigen::Vector3d n(cosine, 0.0, std::sqrt(1.0 - cosine * cosine));
    UnitSamples samples = {};
    addPlaneTo(samples, 0, {n, 0.5});
    EXPECT_EQ(directionConfidence(samples, 0, 0.0f) > 0.0f, cosine > 0.385);
  }
}

TEST(Leaders, WhoSeesOneSideOnlyDoesNotSpeak) {
  for (const double offset : {-0.1, 0.5, 1.1}) {  // all in front; both; all behind
    UnitSamples samples = {};
    addPlaneTo(samples, 4, {Eigen::Vector3d::UnitZ(), offset});
    EXPECT_EQ(directionConfidence(samples, 4, 0.0f) > 0.0f, offset == 0.5);
    EXPECT_EQ(directionConfidence(samples, 4, 1.0f), 0.0f);  // all weights are too little
  }
}

/// All corners in front, the nearest by 0.04, or behind by that.
TEST(Leaders, WhoTouchesACornerSpeaks) {
  for (const double offset : {-0.04, 1.04}) {
    UnitSamples samples = {};
    addPlaneTo(samples, 4, {Eigen::Vector3d::UnitZ(), offset});
    EXPECT_GT(directionConfidence(samples, 4, 0.0f), 0.0f);
  }
}

/// Of Y+ and Z+, equally strong, the first leads; Y- speaks and leads the second sheet, X+ only
/// speaks.
TEST(Leaders, TheStrongestLeadsAndItsOppositeTheSecondSheet) {
  const float confidence[kDirectionCount] = {1.0f, 0.0f, 3.0f, 2.0f, 3.0f, 0.0f};
  const auto leaders = chooseLeaders<int32_t>(confidence);
  EXPECT_EQ(leaders.speaking, 0b011101);
  EXPECT_EQ(leaders.direction[0], 2);
  EXPECT_EQ(leaders.direction[1], 3);
}

TEST(Leaders, WithoutAnOppositeThereIsOneSheet) {
  const float one[kDirectionCount] = {0.0f, 0.0f, 1.0f, 2.0f, 0.0f, 3.0f};
  EXPECT_EQ(chooseLeaders<int32_t>(one).direction[0], 5);
  EXPECT_EQ(chooseLeaders<int32_t>(one).direction[1], -1);
  const float none[kDirectionCount] = {};
  EXPECT_EQ(chooseLeaders<int32_t>(none).speaking, 0);
  EXPECT_EQ(chooseLeaders<int32_t>(none).direction[0], -1);
  EXPECT_EQ(chooseLeaders<int32_t>(none).direction[1], -1);
}

}  // namespace leaders_test
}  // namespace dtsdf
