// How far a line of pixels is walked.
#include "kernels/surfels/line_fit.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace line_fit_test {

/// Where one side ends, the other goes on up to its own limit alone.
TEST(LineFit, GoesOnWithoutTheOtherSideAsFarAsAsked) {
  constexpr int kMiddle = 5, kCount = 11;
  float value[kCount], companion[kCount] = {};
  PixelLinks links[kCount];
  for (int i = 0; i < kCount; ++i) {
    value[i] = 1.0f + 0.25f * static_cast<float>(i);
    links[i] = kLinkRight;
  }
  const auto samples = [&](int one_side) {
    const PixelLine line{1, kLinkRight, 4, 4, one_side};
    const LineFit fit = fitLine({value + kMiddle, companion + kMiddle, links + kMiddle}, line);
    EXPECT_EQ(fit.value, value[kMiddle]);
    EXPECT_EQ(fit.slope, 0.25f);
    return fit.count;
  };
  for (const int one_side : {0, 2, 3}) EXPECT_EQ(samples(one_side), 9) << one_side;
  for (const int cut : {kMiddle - 2, kMiddle + 1}) {  // a pixel is left on that side
    links[cut] = 0;
    EXPECT_EQ(samples(0), 3) << cut;
    EXPECT_EQ(samples(1), 3) << cut;
    EXPECT_EQ(samples(2), 4) << cut;
    EXPECT_EQ(samples(3), 5) << cut;
    links[cut] = kLinkRight;
  }
}

}  // namespace line_fit_test
}  // namespace dtsdf
