#include "io/depth_codes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/compressed_depth.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

using Bytes = std::vector<uint8_t>;

const std::string kPng = "; compressedDepth png", kRvl = "; compressedDepth rvl";

cv::Mat someDepths() {
  cv::Mat image(4, 6, CV_16UC1);
  for (int i = 0; i < 24; ++i) image.at<uint16_t>(i / 6, i % 6) = static_cast<uint16_t>(2731 * i);
  return image;
}

std::vector<uint16_t> pixelsOf(const cv::Mat& image) {
  return {image.begin<uint16_t>(), image.end<uint16_t>()};
}

template <class Pixel>
std::vector<Pixel> pixelsOf(const Raster<uint8_t>& decoded) {
  std::vector<Pixel> pixels(decoded.values.size() / sizeof(Pixel));
  std::memcpy(pixels.data(), decoded.values.data(), decoded.values.size());
  return pixels;
}

std::string errorFor(const std::string& format, const Bytes& data) {
  return errorOf([&] { decodeCompressedDepth(format, data); });
}

TEST(CompressedDepth, SixteenBitDepthsAreExact) {
  const cv::Mat image = someDepths();
  const Bytes png = compressPng(image), rvl = compressRvl(pixelsOf(image), 6);
  for (const char* encoding : {"16UC1", "mono16"}) {
    for (const std::string& code : {kPng, kRvl, std::string("; compressedDepth"), std::string(),
                                    std::string(";compressedDepth ")}) {
      const Raster<uint8_t> decoded =
          decodeCompressedDepth(encoding + code, code == kRvl ? rvl : png);
      EXPECT_EQ(encodingOfCompressedDepth(encoding + code), encoding);
      EXPECT_EQ(decoded.width, 6);
      EXPECT_EQ(decoded.height, 4);
      EXPECT_EQ(pixelsOf<uint16_t>(decoded), pixelsOf(image)) << code;
    }
  }
}

// Quantises inverse depths like the compressedDepth plugin with its default parameters.
TEST(CompressedDepth, FloatsAreStoredAsInverseDepths) {
  const float scale = 100.0f * 101.0f, offset = 1.0f - scale / 10.0f;
  cv::Mat inverse(1, 4, CV_16UC1, cv::Scalar(0));
  const float depths_m[] = {0.5f, 1.0f, 9.0f};
  for (int i = 0; i < 3; ++i) {
    inverse.at<uint16_t>(0, i) = static_cast<uint16_t>(scale / depths_m[i] + offset);
  }
  const Bytes header = compressedHeader(scale, offset);
  for (const auto& [code, data] : {std::pair(kPng, compressPng(inverse, header)),
                                   std::pair(kRvl, compressRvl(pixelsOf(inverse), 4, header))}) {
    const std::vector<float> decoded_m =
        pixelsOf<float>(decodeCompressedDepth("32FC1" + code, data));
    ASSERT_EQ(decoded_m.size(), 4u);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(decoded_m[i], depths_m[i], depths_m[i] * depths_m[i] / scale) << code;
      EXPECT_EQ(decoded_m[i], scale / (static_cast<float>(inverse.at<uint16_t>(0, i)) - offset));
    }
    EXPECT_TRUE(std::isnan(decoded_m[3]));
  }
}

TEST(CompressedDepth, ReportsInvalidData) {
  const Bytes png = compressPng(someDepths());
  EXPECT_NE(errorFor("bgr8; jpeg compressed bgr8", png).find("not a compressed depth format"),
            std::string::npos);
  EXPECT_NE(errorFor("bgr8" + kPng, png).find("'bgr8'"), std::string::npos);
  EXPECT_NE(errorFor("16UC1; compressedDepth zstd", png).find("'zstd'"), std::string::npos);
  for (size_t size = 0; size < 12; ++size) {
    EXPECT_NE(errorFor("16UC1" + kPng, Bytes(size, 0)).find("header"), std::string::npos);
  }
  EXPECT_NE(errorFor("16UC1" + kPng, Bytes(12, 0)).find("not a PNG"), std::string::npos);
  EXPECT_NE(errorFor("16UC1" + kPng, compressPng(cv::Mat(4, 4, CV_8UC1))).find("16-bit grey"),
            std::string::npos);
  EXPECT_NE(errorFor("16UC1" + kRvl, Bytes(19, 0)).find("header"), std::string::npos);
}

TEST(CompressedDepth, SizesAreCheckedBeforeAllocation) {
  for (const auto& [columns, rows] :
       {std::pair(0u, 4u), std::pair(4u, 0u), std::pair(0xffffffffu, 1u),
        std::pair(0xffffffffu, 0xffffffffu), std::pair(1u, 0xffffffffu), std::pair(65536u, 65536u),
        std::pair(1u << 24, 2u)}) {
    Bytes data = compressedHeader();
    appendNumber(data, columns);
    appendNumber(data, rows);
    data.resize(data.size() + 64, 0);
    EXPECT_NE(errorFor("16UC1" + kRvl, data).find(std::to_string(columns) + " x "),
              std::string::npos)
        << columns;
  }
  EXPECT_NE(errorFor("16UC1" + kPng, compressPng(cv::Mat(4097, 4096, CV_16UC1, cv::Scalar(0))))
                .find("has 4096 x 4097"),
            std::string::npos);
}

}  // namespace
}  // namespace dtsdf
