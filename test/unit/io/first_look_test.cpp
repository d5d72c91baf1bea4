#include "io/first_look.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/recording_folder.h"
#include "support/tum_folder.h"

namespace dtsdf {
namespace {

/// Frames of 32-bit pixels, some of them passed over.
class FakeSource : public FrameSource {
 public:
  explicit FakeSource(std::vector<std::vector<float>> images, size_t passed_over = 0)
      : images_(std::move(images)) {
    if (passed_over > 0) skipped_["no_transform"] = passed_over;
  }

  std::optional<size_t> size() const override { return std::nullopt; }
  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

  std::optional<SourceFrame> next() override {
    if (next_ == images_.size()) return std::nullopt;
    const auto pixels = std::make_shared<std::vector<float>>(images_[next_++]);
    SourceFrame frame;
    frame.pixels = pixels;
    frame.depth.data = pixels->data();
    frame.depth.width = static_cast<int>(pixels->size());
    frame.depth.height = 1;
    frame.depth.row_bytes = pixels->size() * sizeof(float);
    frame.depth.encoding = DepthEncoding::kFloat32;
    frame.depth.unit_m = 1.0f;
    frame.depth.intrinsics = {525, 525, 0.5f * static_cast<float>(pixels->size()), 0.5f};
    return frame;
  }

 private:
  std::vector<std::vector<float>> images_;
  size_t next_ = 0;
  std::map<std::string, size_t> skipped_;
};

LookedAt lookAtImages(std::vector<std::vector<float>> images, size_t passed_over = 0) {
  return lookAt(std::make_unique<FakeSource>(std::move(images), passed_over), 2);
}

std::string doubts(const FirstLook& look) {
  std::string text;
  for (const std::string& doubt : doubtsAbout(look, 0.1, 10.0)) text += doubt + "\n";
  return text;
}

TEST(FirstLook, HandsOutEveryFrame) {
  const LookedAt looked = lookAtImages({{1}, {2}, {3}});
  EXPECT_EQ(looked.look.frames, 2u);
  const std::vector<SourceFrame> frames = readAll(*looked.source);
  ASSERT_EQ(frames.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(*static_cast<const float*>(frames[i].depth.data), static_cast<float>(i + 1));
  }
}

TEST(FirstLook, CountsWhatIsMeasured) {
  const FirstLook look = lookAtImages({{1, 0, NAN, -1, INFINITY}, {2, 3, 65535, 0, 0}}).look;
  EXPECT_DOUBLE_EQ(look.measured_share, 0.4);  // 65535 m is none of a 32-bit image's marks
  EXPECT_EQ(look.median_depth_m, 3.0);
}

TEST(FirstLook, SixteenBitsHaveAMarkForNothing) {
  const TemporaryFolder folder;
  writeTumFolder(folder, 1);
  cv::Mat image(kTumHeight, kTumWidth, CV_16UC1, cv::Scalar(65535));
  image.row(0).setTo(5000);
  cv::imwrite(folder / "depth/0.png", image);
  RecordingOptions options;
  options.path = folder.path();
  const FirstLook look = lookAt(openRecording(options), 5).look;
  EXPECT_NEAR(look.measured_share, 1.0 / kTumHeight, 1e-9);
  EXPECT_NEAR(*look.median_depth_m, 1.0, 1e-6);
  EXPECT_EQ(describe(look),
            "1 image of 8 x 6 (fx 10, fy 11, cx 3.5, cy 2.5), 1 with a pose; median depth 1 m, "
            "17 % of the pixels measured");
}

TEST(FirstLook, TellsWhatWasPassedOver) {
  EXPECT_EQ(describe(lookAtImages({{1}, {1}}).look),
            "images of 1 x 1 (fx 525, fy 525, cx 0.5, cy 0.5); median depth 1 m, 100 % of the "
            "pixels measured");
  EXPECT_NE(describe(lookAtImages({{1}, {1}}, 3).look).find("), 3 of the first 5 skipped;"),
            std::string::npos);
  EXPECT_EQ(describe(lookAtImages({}).look), "no usable image");
}

TEST(FirstLook, DoubtsTheScale) {
  const TemporaryFolder folder;
  writeTumFolder(folder, 1);
  RecordingOptions options;
  options.path = folder.path();
  options.units_per_metre = 0.3;  // of 1000 units
  EXPECT_NE(doubts(lookAt(openRecording(options), 5).look)
                .find("median depth 3.33 km: is the scale 0.3?"),
            std::string::npos);
  options.units_per_metre = 1e6;
  EXPECT_NE(
      doubts(lookAt(openRecording(options), 5).look).find("median depth 1 mm: is the scale 1e+06?"),
      std::string::npos)
      << doubts(lookAt(openRecording(options), 5).look);
}

TEST(FirstLook, DoubtsImagesWithoutMeasurements) {
  EXPECT_NE(doubts(lookAtImages({{0, 0}}).look).find("no measured pixel"), std::string::npos);
  std::vector<float> pixels(100, 0.0f);
  pixels[0] = 1.0f;
  EXPECT_NE(doubts(lookAtImages({pixels}).look).find("hardly any pixel"), std::string::npos);
}

TEST(FirstLook, DoubtsPosesThatHardlyMatch) {
  const TemporaryFolder folder;
  writeTumFolder(folder, 5);
  writeBytes(folder / "groundtruth.txt", "100.1 0 0 0 0 0 0 1\n");
  RecordingOptions options;
  options.path = folder.path();
  const FirstLook look = lookAt(openRecording(options), 5).look;
  EXPECT_NE(doubts(look).find("only 1 of 5 images have a pose"), std::string::npos);
  EXPECT_NE(doubts(lookAtImages({{1}, {1}}, 3).look).find("3 of the first 5 images"),
            std::string::npos);
}

}  // namespace
}  // namespace dtsdf
