/// Tests reading folders with a user's own images and with poses in the formats of other programs.
#include <gtest/gtest.h>

#include <map>

#include "support/recording_folder.h"

namespace dtsdf {
namespace {

class OwnImages : public testing::Test {
 protected:
  void SetUp() override {
    for (const int i : {8, 9, 10}) {
      writeDepthImage(folder_ / ("depth/d_" + std::to_string(i) + ".png"), 16, 12, 100 + i);
      writeColourRows(folder_ / ("color/c_" + std::to_string(i) + ".jpg"), 16, 12, 5);
    }
    options_.path = folder_.path();
    options_.intrinsics = Intrinsics{10, 10, 8, 6};
  }

  /// Checks that the poses are read correctly from a file with this text: image i must have the
  /// pose poseMatrix(i - 8).
  void expectPoses(const std::string& name, const std::string& text) {
    writeBytes(folder_ / name, text);
    options_.poses_path = folder_ / name;
    const std::vector<SourceFrame> frames = readAll(*openRecording(options_));
    ASSERT_EQ(frames.size(), 3u) << name;
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(rawAt(frames[i].depth, 0, 0), 108 + i) << "images should be in the order 8, 9, 10";
      EXPECT_TRUE((frames[i].depth.T_W_C * Eigen::Vector3d(1, 2, 3))
                      .isApprox(Eigen::Vector3d(i - 2, -1, 6), 1e-6))
          << name;
    }
    options_.first_pose_only = true;
    EXPECT_NEAR(openRecording(options_)->next()->depth.T_W_C(1, 3), -2.0, 1e-6) << name;
    options_.first_pose_only = false;
  }

  std::string jsonOf(const std::string& kind) const {
    std::string frames;
    for (int i = 0; i < 3; ++i) {
      frames += std::string(i == 0 ? "" : ",") + R"({"file_path": ")" + kind +
                std::to_string(i + 8) + R"(.png", "transform_matrix": [[0, 1, 0, )" +
                std::to_string(i) + "], [1, 0, 0, -2], [0, 0, -1, 3], [0, 0, 0, 1]]}";
    }
    return R"({"fl_x": 10, "fl_y": 11, "cx": 8.5, "cy": 6.5, "frames": [)" + frames + "]}";
  }

  TemporaryFolder folder_;
  RecordingOptions options_;
};

TEST_F(OwnImages, AcceptPosesInManyFormats) {
  std::string tum, kitti, lines, log, colmap = "# comment\n";
  for (int i = 0; i < 3; ++i) {
    const std::string line = poseLine(i), x = std::to_string(i);
    tum += std::to_string(i + 8) + " " + x + " -2 3 0 0 0.70710678 0.70710678\n";
    kitti += line.substr(0, line.size() - 9) + "\n";
    lines += line;
    log += x + " " + x + " 1\n" + poseMatrix(i);

    colmap += x + " 0.70710678 0 0 -0.70710678 2 " + x + " -3 1 c_" + std::to_string(i + 8) +
              ".jpg\n" + (i == 0 ? "1 2 -1\n" : "\n");
    writeBytes(folder_ / ("poses/d_" + std::to_string(i + 8) + ".txt"), poseMatrix(i));
  }
  expectPoses("slam.tum", tum);
  expectPoses("kitti.txt", kitti);
  expectPoses("lines.txt", lines);
  expectPoses("trajectory.log", log);
  expectPoses("images.txt", colmap);
  expectPoses("transforms.json", jsonOf("images/c_"));
  writeBytes(folder_ / "mixed.txt", poseMatrix(0) + poseLine(1));
  options_.poses_path = folder_ / "mixed.txt";
  EXPECT_NE(readingErrorOf(options_).find("mixed.txt:5: expected 4 numbers"), std::string::npos);
  options_.poses_path = folder_ / "poses";
  EXPECT_EQ(readAll(*openRecording(options_)).size(), 3u);
  std::string lost = "-inf";
  for (int i = 1; i < 16; ++i) lost += " -inf";
  writeBytes(folder_ / "poses/d_9.txt", lost);
  const auto source = openRecording(options_);
  EXPECT_EQ(readAll(*source).size(), 2u);
  EXPECT_EQ(
      source->skipped(),
      (std::map<std::string, size_t>{{"the pose is not a rigid motion, or tracking was lost", 1}}));
}

TEST_F(OwnImages, AcceptOtherPoseConventions) {
  std::string opengl;
  for (const std::string x : {"0", "1", "2"})
    opengl += "0 1 0 " + x + " 1 0 0 -2 0 0 -1 3 0 0 0 1\n";
  options_.pose_convention = "opengl";
  expectPoses("opengl.txt", opengl);
  options_.pose_convention = "unknown";
  EXPECT_THROW(openRecording(options_), std::invalid_argument);
}

TEST_F(OwnImages, AreFoundWithCameraAndColour) {
  writeBytes(folder_ / "transforms.json", jsonOf("images/c_"));
  options_.intrinsics.reset();
  options_.pose_convention = "opengl";  // already the convention of transforms.json
  EXPECT_EQ(guessRecordingFormat(options_.path), "png");
  EXPECT_EQ(openRecording(options_)->next()->depth.intrinsics.fy, 11.0f);
  EXPECT_EQ(openRecording(options_)->next()->depth.intrinsics.cx, 8.0f);
  EXPECT_EQ(openRecording(options_)->next()->depth.T_W_C(2, 2), 1.0);
  EXPECT_EQ(readAllColours(options_).size(), 3u);
  options_.selection.step = 2;
  EXPECT_EQ(readAllColours(options_).size(), 2u);
  EXPECT_NE(assumptionsOf(options_).find("--depth-scale"), std::string::npos);
  options_.units_per_metre = 1000.0;
  EXPECT_EQ(assumptionsOf(options_), "");
}

TEST_F(OwnImages, WithoutNumbersAreOrderedByName) {
  const TemporaryFolder folder;
  for (const char* const name : {"a.png", "b.png", "c.png"}) {
    writeDepthImage(folder / name, 16, 12, 108);
  }
  writeBytes(folder / "poses.txt", "1 7 0 0 0 0 0 1\n2 8 0 0 0 0 0 1\n");  // no pose for image 0
  options_.path = folder.path();
  const std::vector<SourceFrame> frames = readAll(*openRecording(options_));
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].depth.T_W_C.translation().x(), 7.0);
  EXPECT_EQ(frames[1].depth.T_W_C.translation().x(), 8.0);
}

TEST_F(OwnImages, DamagedImagesCanBeSkipped) {
  writeBytes(folder_ / "poses.txt", poseLine(0) + poseLine(1) + poseLine(2));
  writeBytes(folder_ / "depth/d_9.png", "junk");
  writeBytes(folder_ / "color/c_10.jpg", "junk");
  EXPECT_NE(readingErrorOf(options_).find("--skip-bad"), std::string::npos);
  writeBytes(folder_ / "depth/d_8.png", "junk");  // damages the first image, too
  options_.skip_bad = true;
  const auto source = openRecording(options_);
  EXPECT_EQ(readAll(*source).size(), 1u);
  EXPECT_EQ(source->skipped().at("bad_image"), 2u);
  EXPECT_NE(source->problems().at("bad_image").find("d_8.png"), std::string::npos);
  EXPECT_EQ(readAllColours(options_).size(), 2u);
  std::filesystem::remove(folder_ / "color/c_8.jpg");
  EXPECT_EQ(readAllColours(options_).at(0).colour.T_W_C(0, 3), 1.0);
}

TEST(TumAssociations, AreNotMistakenForIclNuim) {
  const TemporaryFolder folder;
  std::string list;
  for (int i = 0; i < 3; ++i) {
    const std::string stamp = "100." + std::to_string(i);
    writeDepthImage(folder / ("depth/" + stamp + ".png"), 16, 12, 100 + i);
    writeColourRows(folder / ("rgb/" + stamp + ".png"), 16, 12, 5);
    list += stamp + " rgb/" + stamp + ".png " + stamp + " depth/" + stamp + ".png\n";
  }
  writeBytes(folder / "associations.txt", list);
  writeBytes(folder / "groundtruth.txt", "100 0 0 0 0 0 0 1\n101 0 0 0 0 0 0 1\n");
  RecordingOptions options;
  options.path = folder.path();
  options.pose_tolerance_s = 1.0;
  EXPECT_EQ(guessRecordingFormat(options.path), "tum");
  EXPECT_NE(readingErrorOf(options).find("--intrinsics"), std::string::npos)
      << "the intrinsics of ICL-NUIM should not be assumed";
  options.intrinsics = Intrinsics{10, 10, 8, 6};
  EXPECT_EQ(readAll(*openRecording(options)).size(), 3u);
  EXPECT_EQ(readAllColours(options).size(), 3u);
}

}  // namespace
}  // namespace dtsdf
