#include "dtsdf_mapping/io/recording.h"

#include <gtest/gtest.h>

#include "support/recording_folder.h"
#include "support/tum_folder.h"

namespace dtsdf {
namespace {

TEST(GuessedFormat, BagsAreRecognisedByName) {
  const TemporaryFolder folder;
  writeBytes(folder / "a.bag", "");
  EXPECT_EQ(guessRecordingFormat(folder / "a.bag"), "bag");
  RecordingOptions options;
  options.path = folder / "a.bag";
  EXPECT_NE(readingErrorOf(options).find("is not a folder"), std::string::npos);
}

class Recording : public testing::Test {
 protected:
  void SetUp() override {
    writeTumFolder(folder_, 3);
    options_.path = folder_.path();
  }

  TemporaryFolder folder_;
  RecordingOptions options_;
};

TEST_F(Recording, FormatCanBeGiven) {
  options_.format = "tum";
  EXPECT_EQ(readingErrorOf(options_), "");
  options_.format = "scannet";
  EXPECT_NE(readingErrorOf(options_).find("intrinsic_depth.txt"), std::string::npos);
  options_.format = "svo";
  EXPECT_NE(readingErrorOf(options_).find("'svo' is not a known"), std::string::npos);
}

TEST_F(Recording, PosesCanComeFromAnotherFile) {
  std::filesystem::remove(folder_ / "groundtruth.txt");
  writeBytes(folder_ / "other/slam.tum", "100.1 7 0 0 0 0 0 1\n");
  options_.poses_path = folder_ / "other/slam.tum";
  const auto source = openRecording(options_);
  EXPECT_EQ(source->posed(), 1u);
  const auto frame = source->next();
  ASSERT_TRUE(frame);
  EXPECT_DOUBLE_EQ(frame->stamp_s, 100.1);
  EXPECT_EQ(frame->depth.T_W_C.translation().x(), 7.0);
  writeBytes(options_.poses_path, "100.1 7 0 0\n");
  EXPECT_NE(readingErrorOf(options_).find("slam.tum:1: expected"), std::string::npos);
  options_.poses_path = folder_ / "none.tum";
  EXPECT_NE(readingErrorOf(options_).find("none.tum"), std::string::npos);
}

TEST_F(Recording, FirstPoseOnlyIgnoresLaterPoses) {
  options_.first_pose_only = true;
  options_.selection.first = 1;
  for (const SourceFrame& frame : readAll(*openRecording(options_))) {
    EXPECT_EQ(frame.depth.T_W_C.translation().x(), 1.0);
  }
  std::filesystem::remove(folder_ / "groundtruth.txt");
  const std::vector<SourceFrame> frames = readAll(*openRecording(options_));
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(frames[0].depth.T_W_C.isApprox(Eigen::Isometry3d::Identity(), 0.0));
  options_.poses_path = folder_ / "none.tum";
  EXPECT_NE(readingErrorOf(options_).find("none.tum"), std::string::npos);
}

TEST_F(Recording, PosesMatchByNumberWithoutStamps) {
  const TemporaryFolder scan;
  for (int i = 0; i < 3; ++i) {
    writeDepthImage(scan / ("depth/" + std::to_string(i) + ".png"), 8, 6, 100);
  }
  std::filesystem::create_directory(scan / "pose");
  writeBytes(scan / "slam.tum", "1 7 0 0 0 0 0 1\n2 8 0 0 0 0 0 1\n");
  options_.path = scan.path();
  options_.poses_path = scan / "slam.tum";
  options_.intrinsics = Intrinsics{10, 10, 4, 3};
  const std::vector<SourceFrame> frames = readAll(*openRecording(options_));
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].depth.T_W_C.translation().x(), 7.0);
}

}  // namespace
}  // namespace dtsdf
