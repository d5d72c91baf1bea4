#include "io/inspection.h"

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

Inspection inspectAll(std::unique_ptr<FrameSource> source, size_t frames = 5) {
  Inspection found;
  inspect(std::move(source), frames, found);
  return found;
}

Inspection inspectImages(std::vector<std::vector<float>> images, size_t passed_over = 0) {
  return inspectAll(std::make_unique<FakeSource>(std::move(images), passed_over), 2);
}

std::string doubts(const Inspection& look) {
  std::string text;
  for (const std::string& doubt : warningsAbout(look, 0.1, 10.0)) text += doubt + "\n";
  return text;
}

TEST(Inspection, HandsOutEveryFrame) {
  Inspection found;
  const auto source = inspect(
      std::make_unique<FakeSource>(std::vector<std::vector<float>>{{1}, {2}, {3}}, 0), 2, found);
  EXPECT_EQ(found.frames, 2u);
  const std::vector<SourceFrame> frames = readAll(*source);
  ASSERT_EQ(frames.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(*static_cast<const float*>(frames[i].depth.data), static_cast<float>(i + 1));
  }
}

TEST(Inspection, CountsWhatIsMeasured) {
  const Inspection look = inspectImages({{1, 0, NAN, -1, INFINITY}, {2, 3, 65535, 0, 0}});
  EXPECT_DOUBLE_EQ(look.measured_share, 0.4);  // 65535 m is none of a 32-bit image's marks
  EXPECT_EQ(look.median_depth_m, 3.0);
}

TEST(Inspection, SixteenBitsHaveAMarkForNothing) {
  const TemporaryFolder folder;
  writeTumFolder(folder, 1);
  cv::Mat image(kTumHeight, kTumWidth, CV_16UC1, cv::Scalar(65535));
  image.row(0).setTo(5000);
  cv::imwrite(folder / "depth/0.png", image);
  RecordingOptions options;
  options.path = folder.path();
  const Inspection look = inspectAll(openRecording(options));
  EXPECT_NEAR(look.measured_share, 1.0 / kTumHeight, 1e-9);
  EXPECT_NEAR(*look.median_depth_m, 1.0, 1e-6);
}

TEST(Inspection, DoubtsTheScale) {
  const TemporaryFolder folder;
  writeTumFolder(folder, 1);
  RecordingOptions options;
  options.path = folder.path();
  options.units_per_metre = 0.3;  // of 1000 units
  EXPECT_EQ(doubts(inspectAll(openRecording(options))).find("median depth 3.33 km"), 0u);
  options.units_per_metre = 1e6;
  EXPECT_EQ(doubts(inspectAll(openRecording(options))).find("median depth 1 mm"), 0u);
}

TEST(Inspection, DoubtsImagesWithoutMeasurements) {
  EXPECT_NE(doubts(inspectImages({{0, 0}})).find("no measured pixel"), std::string::npos);
  std::vector<float> pixels(100, 0.0f);
  pixels[0] = 1.0f;
  EXPECT_NE(doubts(inspectImages({pixels})).find("hardly any pixel"), std::string::npos);
}

TEST(Inspection, DoubtsPosesThatHardlyMatch) {
  const TemporaryFolder folder;
  writeTumFolder(folder, 5);
  writeBytes(folder / "groundtruth.txt", "100.1 0 0 0 0 0 0 1\n");
  RecordingOptions options;
  options.path = folder.path();
  const Inspection look = inspectAll(openRecording(options));
  EXPECT_NE(doubts(look).find("only 1 of 5 images have a pose"), std::string::npos);
  EXPECT_NE(doubts(inspectImages({{1}, {1}}, 3)).find("3 of the first 5 images"),
            std::string::npos);
}

}  // namespace
}  // namespace dtsdf
