// What the CPU senses of many pixels at once against the rules for each on its own, bit for bit.
#include "cpu/sense.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/depth.h"
#include "support/links_of_image.h"

namespace dtsdf {
namespace {

/// Slopes, noise, jumps, gaps, blanks and pixels beyond the range, in 16 bits of 0.2 mm.
std::vector<uint16_t> randomImage(int width, int height, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<uint16_t> image;
  for (int i = 0; i < width * height; ++i) {
    const int u = i % width, v = i / width;
    const uint32_t jump = u % 23 > 11 ? 3000 : 0, side = v % 9 > 4 ? 60 * (u % 7) : 3 * u;
    const bool is_blank = v == 3 || (v > 5 && (u < 40 || u > 100));  // rows, and ends of rows
    const uint32_t kind = is_blank ? 0 : random() % 40;
    const uint32_t raw = kind == 0 ? 0 : (kind == 1 ? 65535 : (kind == 2 ? 60000 : 5000));
    image.push_back(static_cast<uint16_t>(raw == 5000 ? raw + jump + side + random() % 8 : raw));
  }
  return image;
}

TEST(Sense, HasTheBitsOfTheRulesPixelByPixel) {
  constexpr int kHeight = 11;
  const MapperParams params;
  FrameSensor sensor(params, Rules(), 2);  // one for images of all sizes
  for (const int width : {130, 1, 2, 3, 65, 130}) {
    const std::vector<uint16_t> image = randomImage(width, kHeight, 7 + width);
    DepthFrame frame;
    frame.data = image.data();
    frame.width = width;
    frame.height = kHeight;
    frame.row_bytes = width * sizeof(uint16_t);
    frame.encoding = DepthEncoding::kUint16;
    frame.unit_m = 0.0002f;
    frame.intrinsics = {500.0f, 500.0f, 0.5f * width, 0.5f * kHeight};
    const FrameSensing sensing = sensor.sense(frame);
    const size_t count = image.size();
    const float* inverse = sensing.image.inverse_depth;
    const DepthRange range = depthRangeOf(frame, params);
    const auto measured = [&](int u, int v) {
      const float depth_m = static_cast<float>(image[v * width + u]) * frame.unit_m;
      const bool is_measured = depth_m > 0.0f && image[v * width + u] < 65535;
      const float sign = depth_m > range.max_m ? -1.0f : 1.0f;
      return is_measured ? sign / depth_m : 0.0f;
    };
    const GapLimits limits =
        gapLimits(makeSurfelSettings(params, SurfelRules()), range, sensing.noise);
    for (size_t i = 0; i < count; ++i) {
      const Pixel pixel{static_cast<int>(i) % width, static_cast<int>(i) / width};
      ASSERT_EQ(inverse[i], filledInverseDepth(measured, width, kHeight, pixel, limits)) << i;
    }
    const std::vector<PixelLinks> links =
        linksOfImage(sensing.image.frame, std::vector<float>(inverse, inverse + count),
                     sensing.noise, makeSurfelSettings(params, SurfelRules()));
    for (size_t i = 0; i < count; ++i) {
      ASSERT_EQ(sensing.image.links[i], links[i]) << i;
      ASSERT_TRUE(inverse[i] > 0.0f || sensing.image.row_value[i] == 0.0f) << i;
      const Pixel pixel{static_cast<int>(i) % width, static_cast<int>(i) / width};
      ASSERT_EQ(sensing.free_depth[i],
                freeDepth(sensing, pixel, makeFusionSettings(params, Rules())))
          << i;
    }
  }
}

}  // namespace
}  // namespace dtsdf
