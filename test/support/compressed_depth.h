/// Encodes depth images like the compressedDepth plugin of image_transport.
#pragma once

#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "support/rvl.h"

namespace dtsdf {

inline void appendNumber(std::vector<uint8_t>& bytes, uint32_t number) {
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<uint8_t>(number >> 8 * i));
}

inline void appendFloat(std::vector<uint8_t>& bytes, float number) {
  uint32_t bits = 0;
  std::memcpy(&bits, &number, sizeof(bits));
  appendNumber(bytes, bits);
}

inline std::vector<uint8_t> compressedHeader(float scale = 0.0f, float offset = 0.0f) {
  std::vector<uint8_t> bytes;
  appendNumber(bytes, 0);
  appendFloat(bytes, scale);
  appendFloat(bytes, offset);
  return bytes;
}

inline std::vector<uint8_t> compressPng(const cv::Mat& image,
                                        std::vector<uint8_t> bytes = compressedHeader()) {
  std::vector<uint8_t> png;
  cv::imencode(".png", image, png);
  bytes.insert(bytes.end(), png.begin(), png.end());
  return bytes;
}

inline std::vector<uint8_t> compressRvl(const std::vector<uint16_t>& pixels, uint32_t columns,
                                        std::vector<uint8_t> bytes = compressedHeader()) {
  appendNumber(bytes, columns);
  appendNumber(bytes, static_cast<uint32_t>(pixels.size()) / columns);
  const std::vector<uint8_t> rvl = encodeRvl(pixels.data(), pixels.size());
  bytes.insert(bytes.end(), rvl.begin(), rvl.end());
  return bytes;
}

}  // namespace dtsdf
