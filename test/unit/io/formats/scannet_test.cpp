/// Tests reading a small ScanNet scan in the folder layout written by the SensReader.
#include <gtest/gtest.h>

#include "support/recording_folder.h"

namespace dtsdf {
namespace {

const char* const kLost =
    "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n"
    "-inf -inf -inf -inf\n";

class ScanNet : public testing::Test {
 protected:
  void SetUp() override {
    for (const int i : {0, 1, 2, 10}) {
      const std::string number = std::to_string(i);
      writeDepthImage(folder_ / ("depth/" + number + ".png"), 16, 12, 100 + i);
      writeBytes(folder_ / ("pose/" + number + ".txt"), i == 1 ? kLost : poseMatrix(i));
    }
    writeBytes(folder_ / "color/0.jpg", "");
    writeBytes(folder_ / "intrinsic/intrinsic_depth.txt",
               "577.590698 0.000000 318.905426 0.000000\n0.000000 578.729797 242.683609 0.000000\n"
               "0.000000 0.000000 1.000000 0.000000\n0.000000 0.000000 0.000000 1.000000\n");
    options_.path = folder_.path();
  }

  TemporaryFolder folder_;
  RecordingOptions options_;
};

TEST_F(ScanNet, OrdersByNumberAndSkipsLostPoses) {
  EXPECT_EQ(guessRecordingFormat(options_.path), "scannet");
  const auto source = openRecording(options_);
  EXPECT_EQ(source->size(), 4u);
  const std::vector<SourceFrame> frames = readAll(*source);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(rawAt(frames[1].depth, 0, 0), 102);
  EXPECT_EQ(rawAt(frames[2].depth, 0, 0), 110);  // image 10 comes after image 2
  EXPECT_FLOAT_EQ(frames[0].depth.unit_m, 0.001f);
  EXPECT_FLOAT_EQ(frames[0].depth.intrinsics.fy, 578.729797f);
  EXPECT_EQ(frames[2].depth.T_W_C.translation().x(), 10.0);
  EXPECT_EQ(
      source->skipped(),
      (std::map<std::string, size_t>{{"the pose is not a rigid motion, or tracking was lost", 1}}));
}

TEST_F(ScanNet, FramesCanBeSelected) {
  options_.selection = {1, 3, 2, {}};  // image 1, which has no pose, and image 10
  const auto source = openRecording(options_);
  EXPECT_EQ(source->size(), 2u);
  EXPECT_EQ(source->posed(), 1u);
  EXPECT_EQ(readAll(*source).size(), 1u);
}

TEST_F(ScanNet, ReportsInvalidFiles) {
  const std::string camera = folder_ / "intrinsic/intrinsic_depth.txt";
  for (const char* matrix :
       {"577 0 318", "a 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "0 0 1 0 0 1 1 0 0 0 1 0 0 0 0 1"}) {
    writeBytes(camera, matrix);
    EXPECT_EQ(readingErrorOf(options_).find(camera), 0u) << readingErrorOf(options_);
  }
  std::filesystem::remove(camera);
  EXPECT_NE(readingErrorOf(options_).find("--intrinsics"), std::string::npos);
  options_.intrinsics = Intrinsics{577, 577, 8, 6};
  EXPECT_EQ(readingErrorOf(options_), "");
  writeBytes(folder_ / "pose/2.txt", "1 0 0 0\n0 1 0");
  EXPECT_NE(readingErrorOf(options_).find("pose/2.txt: expected 4 x 4 numbers"), std::string::npos);
}

// Colour images have their own intrinsics and may differ in size from depth images.
TEST_F(ScanNet, ColourHasItsOwnCamera) {
  for (const int i : {0, 1, 2, 10}) {
    writeColourRows(folder_ / ("color/" + std::to_string(i) + ".jpg"), 32, 20, 5);
  }
  EXPECT_TRUE(readAllColours(options_).empty());
  const auto without_camera = openRecordingColours(options_);
  EXPECT_FALSE(without_camera->next());
  EXPECT_EQ(without_camera->skipped().at("colour images: no intrinsic/intrinsic_color.txt"), 4u);
  writeBytes(folder_ / "intrinsic/intrinsic_color.txt",
             "1170.2 0 647.7 0\n0 1170.2 483.7 0\n0 0 1 0\n0 0 0 1\n");
  const std::vector<SourceColour> images = readAllColours(options_);
  ASSERT_EQ(images.size(), 3u);
  EXPECT_EQ(images[2].stamp_s, 10.0);
  EXPECT_EQ(images[2].colour.width, 32);
  EXPECT_FLOAT_EQ(images[2].colour.intrinsics.cx, 647.7f);
}

}  // namespace
}  // namespace dtsdf
