#include "io/depth_codes.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

std::vector<uint8_t> encode(const cv::Mat& image) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", image, bytes);
  return bytes;
}

TEST(DepthPng, TruncatedDataIsAnError) {
  const std::vector<uint8_t> bytes = encode(cv::Mat(3, 5, CV_16UC1, cv::Scalar(7)));
  for (size_t size = 0; size + 12 < bytes.size(); ++size) {  // the end chunk may be missing
    EXPECT_NE(errorOf([&] { decodeDepthPng(bytes.data(), size); }), "") << size;
  }
}

/// A gAMA chunk describes brightness, so it must not change depths.
TEST(DepthPng, GammaDoesNotChangeDepths) {
  std::vector<uint8_t> bytes = encode(cv::Mat(3, 5, CV_16UC1, cv::Scalar(1234)));
  const std::string gamma("\0\0\0\4gAMA\0\0\xb1\x8f\x0b\xfc\x61\x05", 16);
  constexpr int kHeadBytes = 33;
  bytes.insert(bytes.begin() + kHeadBytes, gamma.begin(), gamma.end());
  EXPECT_EQ(decodeDepthPng(bytes.data(), bytes.size()).values, std::vector<uint16_t>(15, 1234));
}

TEST(DepthPng, SizesAreCheckedBeforeAllocation) {
  // The image has one row too many. All pixels are 0, so the file is small.
  std::vector<uint8_t> bytes = encode(cv::Mat(4097, 2048, CV_16UC1, cv::Scalar(0)));
  bytes.resize(1000);  // the error should be about the size, not the missing bytes
  EXPECT_NE(errorOf([&] { decodeDepthPng(bytes.data(), bytes.size()); }).find("2048 x 4097"),
            std::string::npos);
  const TemporaryFolder folder;
  writeBytes(folder / "large.png", {bytes.begin(), bytes.end()});
  for (const std::string& error :
       {errorOf([&] { readDepthPngSize(folder / "large.png"); }),
        errorOf([&] { readDepthPng(folder / "large.png", 2048, 4097); })}) {
    EXPECT_NE(error.find("large.png' has 2048 x 4097 pixels"), std::string::npos) << error;
  }
}

TEST(DepthPng, SizeIsReadWithoutDecoding) {
  const TemporaryFolder folder;
  const std::vector<uint8_t> bytes = encode(cv::Mat(3, 5, CV_16UC1, cv::Scalar(7)));
  writeBytes(folder / "a.png", std::string(bytes.begin(), bytes.begin() + 45));
  const DepthImage size = readDepthPngSize(folder / "a.png");
  EXPECT_EQ(size.width, 5);
  EXPECT_EQ(size.height, 3);
  EXPECT_NE(errorOf([&] { readDepthPngSize(folder / "none.png"); }).find("no such file"),
            std::string::npos);
}

}  // namespace
}  // namespace dtsdf
