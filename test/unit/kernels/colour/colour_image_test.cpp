#include "kernels/colour/colour_image.h"

#include <gtest/gtest.h>

#include <vector>

namespace dtsdf {
namespace colour_image_test {

/// An image that rises by 4 a pixel to the right in red and downwards in green; blue is 50.
class ColourImageTest : public testing::Test {
 protected:
  void SetUp() override {
    const ColourImage layout = layOut(nullptr, kWidth, kHeight);
    pixels_.resize(static_cast<size_t>(pixelCount(layout)));
    image_ = layOut(pixels_.data(), kWidth, kHeight);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        pixels_[v * kWidth + u] = {static_cast<uint8_t>(4 * u), static_cast<uint8_t>(4 * v), 50, 0};
      }
    }
    for (int i = 1; i < kColourLevels; ++i) {
      const ColourLevel& level = image_.level[i];
      for (int v = 0; v < level.height; ++v) {
        for (int u = 0; u < level.width; ++u) {
          pixels_[level.first + v * level.width + u] = halvedPixel(image_, i, u, v);
        }
      }
    }
  }

  static constexpr int kWidth = 37, kHeight = 24;
  std::vector<ColourPixel> pixels_;
  ColourImage image_;
};

TEST_F(ColourImageTest, LevelsLieBehindEachOther) {
  EXPECT_EQ(image_.level[1].width, 18);
  EXPECT_EQ(image_.level[3].height, 3);
  EXPECT_EQ(pixelCount(image_), 37 * 24 + 18 * 12 + 9 * 6 + 4 * 3);
  EXPECT_EQ(pixelCount(layOut(nullptr, 1, 1)), 4);
}

TEST_F(ColourImageTest, RampsAreTheSameAtEachLevel) {
  for (int level = 0; level < kColourLevels; ++level) {
    for (const float u : {8.0f, 11.3f, 20.9f}) {
      for (const float v : {8.0f, 9.6f, 14.2f}) {
        const Rgb colour = colourAt(image_, level, u, v);
        EXPECT_NEAR(colour.red, 4.0f * (u - 0.5f), 0.6f) << level;
        EXPECT_NEAR(colour.green, 4.0f * (v - 0.5f), 0.6f) << level;
        EXPECT_EQ(colour.blue, 50.0f);
      }
    }
  }
}

TEST_F(ColourImageTest, PixelsAtTheRimGoOn) {
  EXPECT_EQ(colourAt(image_, 0, 0.0f, 0.0f).red, 0.0f);
  EXPECT_EQ(colourAt(image_, 0, 37.0f, 24.0f).red, 4.0f * 36.0f);
  EXPECT_EQ(colourAt(image_, 0, 37.0f, 24.0f).green, 4.0f * 23.0f);
}

TEST(ColourLevels, AreAsWideAsAsked) {
  EXPECT_EQ(levelOfWidth(0.1f), 0);
  EXPECT_EQ(levelOfWidth(1.9f), 0);
  EXPECT_EQ(levelOfWidth(2.0f), 1);
  EXPECT_EQ(levelOfWidth(7.9f), 2);
  EXPECT_EQ(levelOfWidth(1e6f), kColourLevels - 1);
}

}  // namespace colour_image_test
}  // namespace dtsdf
