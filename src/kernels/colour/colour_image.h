/// A colour image and its copies at 1/2, 1/4 and 1/8 of its size. A point's colour is interpolated
/// between four pixels of one of these levels.
#pragma once

#include <cstring>

#include "kernels/core/vec.h"

namespace dtsdf {

/// An RGB pixel, padded to a word by `unused`.
struct ColourPixel {
  uint8_t red, green, blue, unused;
};

/// Layout of a pixel in the caller's image.
struct PixelLayout {
  int32_t bytes;             ///< Per pixel.
  int32_t red, green, blue;  ///< Offsets within the pixel; all equal in grey images.
};

DTSDF_HD ColourPixel takePixel(const uint8_t* pixel, const PixelLayout& layout) {
  return {pixel[layout.red], pixel[layout.green], pixel[layout.blue], 0};
}

/// Number of levels: the full image, then copies, each half as wide and high as the one before.
constexpr int kColourLevels = 4;

struct ColourLevel {
  int32_t width, height;
  int64_t first;  ///< Index of its first pixel among the pixels of all levels.
};

struct ColourImage {
  const ColourPixel* pixels;  ///< All levels, row-major without padding.
  ColourLevel level[kColourLevels];
};

DTSDF_HD ColourLevel halfOf(const ColourLevel& level) {
  const int32_t width = level.width / 2, height = level.height / 2;
  return {width > 0 ? width : 1, height > 0 ? height : 1,
          level.first + static_cast<int64_t>(level.width) * level.height};
}

/// Describes the levels of an image that is stored at `pixels`.
DTSDF_HD ColourImage layOut(const ColourPixel* pixels, int32_t width, int32_t height) {
  ColourImage image;
  image.pixels = pixels;
  image.level[0] = {width, height, 0};
  for (int i = 1; i < kColourLevels; ++i) image.level[i] = halfOf(image.level[i - 1]);
  return image;
}

/// Number of pixels in all levels.
DTSDF_HD int64_t pixelCount(const ColourImage& image) {
  const ColourLevel& last = image.level[kColourLevels - 1];
  return last.first + static_cast<int64_t>(last.width) * last.height;
}

DTSDF_HD const ColourPixel& pixelAt(const ColourImage& image, const ColourLevel& level, int32_t u,
                                    int32_t v) {
  const int32_t x = u < 0 ? 0 : (u < level.width ? u : level.width - 1);
  const int32_t y = v < 0 ? 0 : (v < level.height ? v : level.height - 1);
  return image.pixels[level.first + static_cast<int64_t>(y) * level.width + x];
}

/// The mean of four pixels, rounded per byte. Two bytes of a word are summed at once, in 16 bits
/// each.
DTSDF_HD uint32_t meanOfPixels(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  constexpr uint32_t kBytes = 0x00ff00ff, kHalf = 0x00020002;
  const uint32_t even = (a & kBytes) + (b & kBytes) + (c & kBytes) + (d & kBytes) + kHalf;
  const uint32_t odd =
      (a >> 8 & kBytes) + (b >> 8 & kBytes) + (c >> 8 & kBytes) + (d >> 8 & kBytes) + kHalf;
  return (even >> 2 & kBytes) | (odd >> 2 & kBytes) << 8;
}

DTSDF_HD uint32_t toWord(const ColourPixel& pixel) {
  uint32_t word;
  memcpy(&word, &pixel, sizeof(word));
  return word;
}

DTSDF_HD ColourPixel meanOf(const ColourPixel& a, const ColourPixel& b, const ColourPixel& c,
                            const ColourPixel& d) {
  const uint32_t word = meanOfPixels(toWord(a), toWord(b), toWord(c), toWord(d));
  ColourPixel mean;
  memcpy(&mean, &word, sizeof(mean));
  return mean;
}

/// A pixel of a level, averaged from four pixels of the previous level.
DTSDF_HD ColourPixel halvedPixel(const ColourImage& image, int level, int32_t u, int32_t v) {
  const ColourLevel& finer = image.level[level - 1];
  return meanOf(pixelAt(image, finer, 2 * u, 2 * v), pixelAt(image, finer, 2 * u + 1, 2 * v),
                pixelAt(image, finer, 2 * u, 2 * v + 1),
                pixelAt(image, finer, 2 * u + 1, 2 * v + 1));
}

/// The coarsest level at which a pixel spans at most `width_px` pixels of the full image; 0 if no
/// level does.
DTSDF_HD int levelOfWidth(float width_px) {
  int level = 0;
  for (int l = 1; l < kColourLevels; ++l) level += width_px >= static_cast<float>(1 << l) ? 1 : 0;
  return level;
}

/// A colour; each channel ranges from 0 to 255.
struct Rgb {
  float red, green, blue;
};

DTSDF_HD Rgb rgbAt(const ColourImage& image, const ColourLevel& level, int32_t u, int32_t v) {
  const ColourPixel& pixel = pixelAt(image, level, u, v);
  return {static_cast<float>(pixel.red), static_cast<float>(pixel.green),
          static_cast<float>(pixel.blue)};
}

DTSDF_HD float between(float a, float b, float share) { return a + share * (b - a); }

DTSDF_HD Rgb between(const Rgb& a, const Rgb& b, float share) {
  return {between(a.red, b.red, share), between(a.green, b.green, share),
          between(a.blue, b.blue, share)};
}

/// The colour at a point of the image, interpolated bilinearly between pixels of a level. u_px and
/// v_px are in pixels of the full image, measured from the corner of its first pixel.
DTSDF_HD Rgb colourAt(const ColourImage& image, int level_number, float u_px, float v_px) {
  const ColourLevel& level = image.level[level_number];
  const float scale = 1.0f / static_cast<float>(1 << level_number);
  const float u = u_px * scale - 0.5f, v = v_px * scale - 0.5f;
  const int32_t u0 = floorToInt(u), v0 = floorToInt(v);
  const float du = u - static_cast<float>(u0), dv = v - static_cast<float>(v0);
  return between(between(rgbAt(image, level, u0, v0), rgbAt(image, level, u0 + 1, v0), du),
                 between(rgbAt(image, level, u0, v0 + 1), rgbAt(image, level, u0 + 1, v0 + 1), du),
                 dv);
}

}  // namespace dtsdf
