/// Tests reading a TUM RGB-D recording as downloaded, without camera_info.yaml.
#include <gtest/gtest.h>

#include "support/recording_folder.h"

namespace dtsdf {
namespace {

const char* const kComments =
    "# depth maps\n# file: 'rgbd_dataset_freiburg1_xyz.bag'\n"
    "# timestamp filename\n";

class TumArchive : public testing::Test {
 protected:
  void SetUp() override {
    writeDepthImage(folder_ / "depth/1305031102.160407.png", 640, 480, 10);
    writeBytes(folder_ / "depth.txt",
               std::string(kComments) + "1305031102.160407 depth/1305031102.160407.png\n");
    writeBytes(folder_ / "rgb.txt",
               std::string(kComments) + "1305031102.175304 rgb/1305031102.175304.png\n");
    writeBytes(folder_ / "accelerometer.txt", "# timestamp ax ay az\n");
    writeBytes(folder_ / "groundtruth.txt",
               "# ground truth trajectory\n# file: 'rgbd_dataset_freiburg1_xyz.bag'\n"
               "# timestamp tx ty tz qx qy qz qw\n"
               "1305031102.1558 1.3405 0.6266 1.6575 0.6574 0.6126 -0.2949 -0.3248\n"
               "1305031102.1658 1.3303 0.6256 1.6464 0.6579 0.6161 -0.2932 -0.3189\n");
    options_.path = folder_.path();
  }

  TemporaryFolder folder_;
  RecordingOptions options_;
};

TEST_F(TumArchive, UsesTheBenchmarksCamera) {
  EXPECT_EQ(guessRecordingFormat(options_.path), "tum");
  const auto source = openRecording(options_);
  EXPECT_EQ(source->posed(), 1u);
  const auto frame = source->next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->depth.intrinsics.fx, 525.0f);
  EXPECT_EQ(frame->depth.intrinsics.fy, 525.0f);
  EXPECT_EQ(frame->depth.intrinsics.cx, 319.5f);
  EXPECT_EQ(frame->depth.intrinsics.cy, 239.5f);
  EXPECT_FLOAT_EQ(frame->depth.unit_m, 1.0f / 5000.0f);
  EXPECT_NEAR(frame->depth.T_W_C.translation().x(), 1.3358, 1e-3);
}

TEST_F(TumArchive, IsAlsoRecognisedByFolderName) {
  const TemporaryFolder parent;
  const std::string renamed = parent / "rgbd_dataset_freiburg3_desk";
  std::filesystem::rename(folder_.path(), renamed);
  for (const char* list : {"/depth.txt", "/groundtruth.txt"}) {
    std::string text = readBytes(renamed + list);
    text.erase(0, text.rfind("filename") == std::string::npos ? text.rfind("qw\n") + 3
                                                              : text.rfind("filename") + 9);
    writeBytes(renamed + list, text);
  }
  options_.path = renamed + "/";
  EXPECT_EQ(readingErrorOf(options_), "");
}

TEST_F(TumArchive, OtherRecordingsNeedIntrinsics) {
  for (const char* list : {"depth.txt", "groundtruth.txt"}) {
    std::string text = readBytes(folder_ / list);
    text.replace(text.find("freiburg"), 8, "our_desk");
    writeBytes(folder_ / list, text);
  }
  EXPECT_NE(readingErrorOf(options_).find("--intrinsics"), std::string::npos)
      << readingErrorOf(options_);
  options_.intrinsics = Intrinsics{500, 501, 300, 200};
  const auto frame = openRecording(options_)->next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->depth.width, 640);
  EXPECT_EQ(frame->depth.intrinsics.fy, 501.0f);
}

TEST_F(TumArchive, CameraInfoIsUsedIfPresent) {
  writeBytes(folder_ / "camera_info.yaml",
             "image_width: 640\nimage_height: 480\n"
             "camera_matrix: {data: [520, 0, 320, 0, 521, 240, 0, 0, 1]}\n");
  EXPECT_EQ(openRecording(options_)->next()->depth.intrinsics.fx, 520.0f);
}

TEST_F(TumArchive, ReportsStampsThatDoNotOverlap) {
  writeBytes(folder_ / "groundtruth.txt", "0.5 0 0 0 0 0 0 1\n9.5 0 0 0 0 0 0 1\n");
  const std::string error = readingErrorOf(options_);
  EXPECT_NE(error.find("image stamps are 1305031102.160 to 1305031102.160 s, "
                       "pose stamps 0.500 to 9.500"),
            std::string::npos)
      << error;
  writeBytes(folder_ / "groundtruth.txt", "# nothing\n");
  EXPECT_NE(readingErrorOf(options_).find("empty"), std::string::npos);
}

TEST_F(TumArchive, ColourHasTheSameCamera) {
  writeColourRows(folder_ / "rgb/1305031102.175304.png", 640, 480, 0);
  const std::vector<SourceColour> images = readAllColours(options_);
  ASSERT_EQ(images.size(), 1u);
  EXPECT_EQ(images[0].stamp_s, 1305031102.175304);
  EXPECT_EQ(images[0].colour.intrinsics.cx, 319.5f);
}

}  // namespace
}  // namespace dtsdf
