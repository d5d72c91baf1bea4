/// Tests reading a small Replica recording in the folder layout of NICE-SLAM.
#include <gtest/gtest.h>

#include "support/recording_folder.h"

namespace dtsdf {
namespace {

const char* const kParams =
    "{\n \"camera\": {\n  \"w\": 12,\n  \"h\": 8,\n  \"fx\": 600.0,\n  \"fy\": 601.0,\n"
    "  \"cx\": 5.5,\n  \"cy\": 3.5,\n  \"scale\": 6553.5\n }\n}\n";

class Replica : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 3; ++i) {
      const std::string name = "Replica/room0/results/depth00000" + std::to_string(i) + ".png";
      writeDepthImage(folder_ / name, 12, 8, 1000 + i);
      trajectory_ += poseLine(i);
    }
    writeBytes(folder_ / "Replica/room0/results/frame000000.jpg", "");
    writeBytes(folder_ / "Replica/room0/traj.txt", trajectory_);
    writeBytes(folder_ / "Replica/cam_params.json", kParams);
    options_.path = folder_ / "Replica/room0";
  }

  std::string errorWith(const std::string& file, const std::string& text) const {
    const std::string whole = readBytes(folder_ / file);
    writeBytes(folder_ / file, text);
    const std::string error = readingErrorOf(options_);
    writeBytes(folder_ / file, whole);
    return error;
  }

  TemporaryFolder folder_;
  std::string trajectory_;
  RecordingOptions options_;
};

TEST_F(Replica, ReadsTheCameraFromTheParentFolder) {
  for (const char* end : {"", "/"}) {
    options_.path = folder_ / "Replica/room0" + end;
    EXPECT_EQ(guessRecordingFormat(options_.path), "replica");
    const std::vector<SourceFrame> frames = readAll(*openRecording(options_));
    ASSERT_EQ(frames.size(), 3u);
    const DepthFrame& frame = frames[2].depth;
    EXPECT_EQ(rawAt(frame, 0, 0), 1002);
    EXPECT_FLOAT_EQ(frame.unit_m, 1.0f / 6553.5f);
    EXPECT_EQ(frame.intrinsics.fy, 601.0f);
    EXPECT_EQ(frame.intrinsics.cx, 5.5f);
    EXPECT_TRUE((frame.T_W_C * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d(2, -1, 3), 1e-9));
  }
}

TEST_F(Replica, GivenScaleOverridesTheFile) {
  std::string params = kParams;
  params.replace(params.find("6553.5"), 6, "1000.0");
  writeBytes(folder_ / "Replica/cam_params.json", params);
  EXPECT_FLOAT_EQ(openRecording(options_)->next()->depth.unit_m, 0.001f);
  options_.units_per_metre = 2000.0;
  EXPECT_FLOAT_EQ(openRecording(options_)->next()->depth.unit_m, 0.0005f);
}

TEST_F(Replica, NeedsNoFileIfTheCameraIsGiven) {
  std::filesystem::remove(folder_ / "Replica/cam_params.json");
  EXPECT_NE(readingErrorOf(options_).find("cam_params.json"), std::string::npos);
  EXPECT_NE(readingErrorOf(options_).find("--intrinsics"), std::string::npos);
  options_.intrinsics = Intrinsics{600, 600, 5.5f, 3.5f};
  EXPECT_FLOAT_EQ(openRecording(options_)->next()->depth.unit_m, 1.0f / 6553.5f);
  EXPECT_EQ(assumptionsOf(options_), "6553.5 units per metre (--depth-scale)");
}

TEST_F(Replica, ImagesBeyondTheTrajectoryAreCounted) {
  writeBytes(folder_ / "Replica/room0/traj.txt", poseLine(0));
  const auto source = openRecording(options_);
  EXPECT_EQ(readAll(*source).size(), 1u);
  EXPECT_EQ(source->skipped(),
            (std::map<std::string, size_t>{{"no pose with the same number", 2}}));
}

TEST_F(Replica, ReportsInvalidFiles) {
  const std::string params = "Replica/cam_params.json", poses = "Replica/room0/traj.txt";
  for (const char* text : {"", "{", "[]", "{\"camera\": 1}", "{\"camera\": {}}",
                           "{\"camera\": {\"w\": -1}}", "{\"camera\": {\"w\": 1e300}}"}) {
    EXPECT_NE(errorWith(params, text).find("cam_params.json: "), std::string::npos) << text;
  }
  for (const char* line : {"1 2 3", "a 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"}) {
    EXPECT_NE(errorWith(poses, poseLine(0) + line).find("traj.txt:2: "), std::string::npos) << line;
  }
  EXPECT_NE(errorWith(poses, ""), "");
}

TEST_F(Replica, ColourHasTheSameCamera) {
  for (const int i : {0, 1, 2, 3}) {  // image 3 has no pose in traj.txt
    const std::string name = "Replica/room0/results/frame00000" + std::to_string(i) + ".jpg";
    writeColourRows(folder_ / name, 12, 8, 5);
  }
  const std::vector<SourceColour> images = readAllColours(options_);
  ASSERT_EQ(images.size(), 3u);
  EXPECT_EQ(images[2].colour.intrinsics.fy, 601.0f);
  EXPECT_EQ(images[2].colour.T_W_C.translation().x(), 2.0);
}

}  // namespace
}  // namespace dtsdf
