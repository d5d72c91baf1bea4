/// Tests reading a small 7-Scenes sequence.
#include <gtest/gtest.h>

#include "dtsdf_mapping/mapper.h"
#include "support/recording_folder.h"

namespace dtsdf {
namespace {

class SevenScenes : public testing::Test {
 protected:
  void SetUp() override {
    for (const int number : {0, 2, 10}) writeFrame(number, poseMatrix(number));
    options_.path = folder_ / "chess/seq-01";
  }

  std::string stemOf(int number) const {
    char name[64];
    std::snprintf(name, sizeof(name), "chess/seq-01/frame-%06d", number);
    return folder_ / name;
  }

  void writeFrame(int number, const std::string& pose) const {
    writeDepthImage(stemOf(number) + ".depth.png", 640, 480, 1 + number);
    writeBytes(stemOf(number) + ".color.png", "");
    writeBytes(stemOf(number) + ".pose.txt", pose);
  }

  TemporaryFolder folder_;
  RecordingOptions options_;
};

TEST_F(SevenScenes, UsesMillimetresAndOneFixedCamera) {
  EXPECT_EQ(guessRecordingFormat(options_.path), "7scenes");
  const auto source = openRecording(options_);
  const std::vector<SourceFrame> frames = readAll(*source);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[1].stamp_s, 2.0);
  EXPECT_EQ(frames[2].stamp_s, 10.0);
  const DepthFrame& frame = frames[2].depth;
  EXPECT_EQ(rawAt(frame, 0, 1), 22);
  EXPECT_FLOAT_EQ(frame.unit_m, 0.001f);
  EXPECT_EQ(frame.intrinsics.fx, 585.0f);
  EXPECT_EQ(frame.intrinsics.fy, 585.0f);
  EXPECT_EQ(frame.intrinsics.cx, 320.0f);
  EXPECT_EQ(frame.intrinsics.cy, 240.0f);
  EXPECT_TRUE((frame.T_W_C * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d(10, -1, 3), 1e-9));
}

TEST_F(SevenScenes, Values0And65535AreNotMeasurements) {
  for (const uint16_t nothing : {uint16_t{0}, uint16_t{65535}}) {
    cv::imwrite(stemOf(0) + ".depth.png", cv::Mat(480, 640, CV_16UC1, cv::Scalar(nothing)));
    MapperParams params;
    params.backend = Backend::kCpu;
    EXPECT_EQ(makeMapper(params)->integrate(openRecording(options_)->next()->depth).status,
              FrameStatus::kNoMeasurement)
        << nothing;
  }
}

TEST_F(SevenScenes, LostAndMissingPosesAreCounted) {
  writeFrame(11,
             "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n"
             "-inf -inf -inf -inf\n");
  writeFrame(12, "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  writeFrame(13, "1.#QNAN 0 0 0\n0 1.#IND 0 0\n0 0 1.#INF 0\n0 0 0 1\n");
  writeFrame(14, "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n");
  writeFrame(15, "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n");  // a reflection, not a rotation
  writeFrame(16, "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n");
  writeFrame(17, "");
  std::filesystem::remove(stemOf(17) + ".pose.txt");
  const auto source = openRecording(options_);
  EXPECT_EQ(source->posed(), 3u);
  EXPECT_EQ(readAll(*source).size(), 3u);
  EXPECT_EQ(source->skipped(),
            (std::map<std::string, size_t>{
                {"no pose file", 1}, {"the pose is not a rigid motion, or tracking was lost", 6}}));
}

TEST_F(SevenScenes, ReportsInvalidPosesAndImageSizes) {
  for (const char* pose :
       {"", "1 0 0", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 0", "x 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1",
        "1e999 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "1;0;0;0"}) {
    writeBytes(stemOf(2) + ".pose.txt", pose);
    EXPECT_NE(readingErrorOf(options_).find("frame-000002.pose.txt: expected 4 x 4 numbers"),
              std::string::npos)
        << pose << " -> " << readingErrorOf(options_);
  }
  writeFrame(2, poseMatrix(2));
  writeDepthImage(stemOf(10) + ".depth.png", 320, 240, 1);
  EXPECT_NE(readingErrorOf(options_).find("320 x 240 pixels, but the camera has 640 x 480"),
            std::string::npos);
}

TEST_F(SevenScenes, NoPoseAtAllIsAnError) {
  for (const int number : {0, 2, 10}) std::filesystem::remove(stemOf(number) + ".pose.txt");
  EXPECT_NE(readingErrorOf(options_).find("none of the 3 depth images has a pose (no pose file)"),
            std::string::npos)
      << readingErrorOf(options_);
}

TEST_F(SevenScenes, ReadsTheCameraFileOfTsdfFusion) {
  const std::string path = options_.path + "/camera-intrinsics.txt";
  writeBytes(path, " 6.15e+02 0.0 298.4 \n 0.0 616 247.5\n 0 0 1\n");
  const Intrinsics K = openRecording(options_)->next()->depth.intrinsics;
  EXPECT_EQ(K.fx, 615.0f);
  EXPECT_EQ(K.fy, 616.0f);
  EXPECT_EQ(K.cy, 247.5f);
  for (const char* matrix :
       {"", "585 0 320 0", "-585 0 320 0 585 240 0 0 1", "nan 0 320 0 585 240 0 0 1"}) {
    writeBytes(path, matrix);
    EXPECT_EQ(readingErrorOf(options_).find(path), 0u) << readingErrorOf(options_);
  }
}

TEST_F(SevenScenes, ErrorsListTheSequencesOfAScene) {
  options_.path = folder_ / "chess";
  const std::string error = readingErrorOf(options_);
  EXPECT_NE(error.find("it contains recordings: 'seq-01'"), std::string::npos) << error;
}

TEST_F(SevenScenes, ColourSharesCameraAndPoseWithDepth) {
  for (const int number : {0, 2, 10}) {
    std::filesystem::remove(stemOf(number) + ".color.png");
    writeColourRows(stemOf(number) + (number == 2 ? ".color.jpg" : ".color.png"), 640, 480, 0);
  }
  std::filesystem::remove(stemOf(0) + ".pose.txt");
  const std::vector<SourceColour> images = readAllColours(options_);
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(images[0].stamp_s, 2.0);
  EXPECT_EQ(images[1].colour.T_W_C.translation().x(), 10.0);
  EXPECT_EQ(images[1].colour.intrinsics.fx, 585.0f);
}

}  // namespace
}  // namespace dtsdf
