#include "dtsdf_mapping/io/recording.h"

#include <gtest/gtest.h>

#include "support/tum_folder.h"

namespace dtsdf {
namespace {

class TumFramesTest : public testing::Test {
 protected:
  void SetUp() override {
    writeTumFolder(folder_, 5);
    options_.path = folder_.path();
    options_.format = "tum";
  }

  /// Reads all frames. @return Their indices; all pixels of frame i are 1000 * (i + 1).
  std::vector<int> readIndices(FrameSource& source) const {
    std::vector<int> indices;
    while (const auto frame = source.next()) {
      indices.push_back(*static_cast<const uint16_t*>(frame->depth.data) / 1000 - 1);
    }
    return indices;
  }

  std::string error() const {
    return errorOf([&] { openRecording(options_)->next(); });
  }

  TemporaryFolder folder_;
  RecordingOptions options_;
};

TEST_F(TumFramesTest, ReadsCompleteFrames) {
  const auto source = openRecording(options_);
  EXPECT_EQ(source->size(), 5u);
  source->next();
  const auto frame = source->next();
  ASSERT_TRUE(frame);
  const DepthFrame& depth = frame->depth;
  EXPECT_DOUBLE_EQ(frame->stamp_s, 100.1);
  EXPECT_EQ(depth.width, kTumWidth);
  EXPECT_EQ(depth.height, kTumHeight);
  EXPECT_EQ(depth.encoding, DepthEncoding::kUint16);
  EXPECT_FLOAT_EQ(depth.unit_m, 1.0f / 5000.0f);
  EXPECT_EQ(depth.intrinsics.cx, 3.5f);
  EXPECT_EQ(depth.T_W_C.translation().x(), 1.0);
  for (int v = 0; v < depth.height; ++v) {
    const auto* row = reinterpret_cast<const uint16_t*>(static_cast<const char*>(depth.data) +
                                                        v * depth.row_bytes);
    for (int u = 0; u < depth.width; ++u) EXPECT_EQ(row[u], 2000);
  }
}

TEST_F(TumFramesTest, ReadsEveryPixelValueExactly) {
  cv::Mat image(256, 256, CV_16UC1);
  for (int i = 0; i < 65536; ++i) image.at<uint16_t>(i / 256, i % 256) = static_cast<uint16_t>(i);
  cv::imwrite(folder_ / "depth/0.png", image);
  writeBytes(folder_ / "camera_info.yaml",
             "image_width: 256\nimage_height: 256\n"
             "camera_matrix: {data: [9, 0, 5, 0, 9, 5, 0, 0, 1]}\n");
  const auto frame = openRecording(options_)->next();
  const auto* pixels = static_cast<const uint16_t*>(frame->depth.data);
  for (int i = 0; i < 65536; ++i) ASSERT_EQ(pixels[i], i);
}

TEST_F(TumFramesTest, FramesOutliveTheirSource) {
  auto source = openRecording(options_);
  const auto first = source->next(), second = source->next();
  source.reset();
  EXPECT_EQ(*static_cast<const uint16_t*>(first->depth.data), 1000);
  EXPECT_EQ(*static_cast<const uint16_t*>(second->depth.data), 2000);
}

TEST_F(TumFramesTest, SelectsByIndexInTheOrderOfStamps) {
  writeBytes(folder_ / "depth.txt",
             "100.3 depth/3.png\n100.0 depth/0.png\n100.2 depth/2.png\n100.1 depth/1.png\n");
  options_.selection = {1, 4, 2, {}};
  const auto source = openRecording(options_);
  EXPECT_EQ(source->size(), 2u);
  EXPECT_EQ(readIndices(*source), (std::vector<int>{1, 3}));
}

TEST_F(TumFramesTest, SkipsAndCountsFramesWithoutPose) {
  writeBytes(folder_ / "groundtruth.txt",
             "100.0 0 0 0 0 0 0 1\n100.31 3 0 0 0 0 0 1\n100.45 3 0 0 0 0 0 1\n");
  const auto source = openRecording(options_);
  EXPECT_EQ(readIndices(*source), (std::vector<int>{0, 3}));
  EXPECT_EQ(source->skipped(), (std::map<std::string, size_t>{{"no pose within 20 ms", 3}}));
}

TEST_F(TumFramesTest, AppliesTheDepthScale) {
  options_.units_per_metre = 1000.0;
  EXPECT_FLOAT_EQ(openRecording(options_)->next()->depth.unit_m, 0.001f);
  options_.units_per_metre = 0.0;
  EXPECT_NE(error(), "");
}

TEST_F(TumFramesTest, ErrorsNameTheInvalidImage) {
  const std::string path = folder_ / "depth/0.png";
  const auto expectError = [&](const std::string& expected) {
    EXPECT_NE(error().find(path), std::string::npos) << error();
    EXPECT_NE(error().find(expected), std::string::npos) << error();
  };
  cv::imwrite(path, cv::Mat(kTumHeight, kTumWidth, CV_8UC1, cv::Scalar(7)));
  expectError("not a 16-bit greyscale image");
  cv::imwrite(path, cv::Mat(kTumHeight, kTumWidth, CV_16UC3, cv::Scalar(7, 8, 9)));
  expectError("not a 16-bit greyscale image");
  cv::imwrite(path, cv::Mat(kTumHeight, kTumWidth + 1, CV_16UC1, cv::Scalar(7)));
  expectError("9 x 6 pixels");
  writeBytes(path, "this is no image");
  expectError("cannot decode");
  std::filesystem::remove(path);
  expectError("no such file");
}

}  // namespace
}  // namespace dtsdf
