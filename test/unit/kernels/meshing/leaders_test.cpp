#include "kernels/meshing/leaders.h"

#include <gtest/gtest.h>

#include <cmath>

#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace leaders_test {

/// sin(pi/8) is 0.3827: a gradient with a cosine of 0.38 is out of X+, one with 0.39 is in.
TEST(Leaders, TheGradientHasToLieInTheDirectionsRange) {
  for (const double cosine : {0.38, 0.39}) {
    const Eigen::Vector3d n(cosine, 0.0, std::sqrt(1.0 - cosine * cosine));
    UnitSamples samples = {};
    addPlaneTo(samples, 0, {n, 0.5});
    EXPECT_EQ(directionConfidence(samples, 0, 0.0f) > 0.0f, cosine > 0.385);
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
