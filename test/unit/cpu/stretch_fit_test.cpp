// Fits of many pixels at once against the fit of each on its own, bit for bit.
#include "cpu/stretch_fit.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace dtsdf {
namespace {

TEST(StretchFit, HasTheBitsOfTheFitsOneByOne) {
  constexpr int kWidth = 50, kHeight = 40;
  std::mt19937 random(31);
  std::uniform_real_distribution<float> noise(-0.02f, 0.02f);
  std::vector<float> values, companions;
  std::vector<PixelLinks> links;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const float step = i % kWidth > 20 ? 0.3f : 0.0f;
    values.push_back(random() % 8 == 0 ? 0.0f : 0.5f + step + noise(random));
    companions.push_back(noise(random));
    links.push_back(random() % 8 == 0 ? 0 : (random() % 8 == 0 ? kLinkRight : kLinkDown));
  }
  const SurfelSettings surfels{5, 0.04f, SurfelRules(), 0};
  FrameView frame{};
  frame.intrinsics.fx = 525.0f;
  frame.voxel_size_m = 10.0f / 525.0f;
  const FitWindow window = fitWindow(frame, {0.0f, 0}, surfels);
  for (const int pixels : {1, 3, kWidth}) {
    for (int v = 0; v < kHeight; ++v) {
      const int64_t first = v * kWidth;
      const int before = std::min(v, 5), after = std::min(kHeight - 1 - v, 5);
      StretchFit fits;
      fits.compute({pixels, {&values[first], &companions[first], &links[first]}},
                   {kWidth, kLinkDown, before, after, 5}, window);
      for (int u = 0; u < pixels; ++u) {
        if (!(values[first + u] > 0.0f)) continue;
        const WindowRadius radius = windowRadius(values[first + u], window);
        const PixelLine line{kWidth, kLinkDown, std::min(before, radius.both),
                             std::min(after, radius.both), radius.one_side};
        const LineFit one =
            fitLine({&values[first + u], &companions[first + u], &links[first + u]}, line);
        const LineFit fit = fits.fit(u);
        ASSERT_EQ(fit.value, one.value) << u << " " << v;
        ASSERT_EQ(fit.slope, one.slope) << u << " " << v;
        ASSERT_EQ(fit.mean_companion, one.mean_companion) << u << " " << v;
        ASSERT_EQ(fit.count, one.count) << u << " " << v;
      }
    }
  }
}

}  // namespace
}  // namespace dtsdf
