#include "io/camera_file.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

const char kSize[] = "image_width: 640\nimage_height: 480\n";
const char kCameraMatrix[] =
    "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [500.0, 0, 320, 0, 510.0, 240, 0, 0, 1]\n";
const char kProjectionMatrix[] =
    "projection_matrix:\n  rows: 3\n  cols: 4\n"
    "  data: [600.5, 0, 319.5, 0, 0, 610.5, 239.5, 0, 0, 0, 1, 0]\n";

class CameraInfoFile : public testing::Test {
 protected:
  CameraInfo load(const std::string& text) {
    writeBytes(path_, text);
    return loadCameraInfo(path_);
  }
  std::string errorFor(const std::string& text) {
    return errorOf([&] { load(text); });
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "camera_info.yaml";
};

TEST_F(CameraInfoFile, PrefersTheProjectionMatrix) {
  const CameraInfo info = load(std::string(kSize) + kCameraMatrix + kProjectionMatrix);
  EXPECT_EQ(info.width, 640);
  EXPECT_EQ(info.height, 480);
  EXPECT_EQ(info.intrinsics.fx, 600.5f);
  EXPECT_EQ(info.intrinsics.fy, 610.5f);
  EXPECT_EQ(info.intrinsics.cx, 319.5f);
  EXPECT_EQ(info.intrinsics.cy, 239.5f);
}

TEST_F(CameraInfoFile, FallsBackOnTheCameraMatrix) {
  const CameraInfo info = load(std::string(kSize) + kCameraMatrix);
  EXPECT_EQ(info.intrinsics.fx, 500.0f);
  EXPECT_EQ(info.intrinsics.fy, 510.0f);
  EXPECT_EQ(info.intrinsics.cx, 320.0f);
  EXPECT_EQ(info.intrinsics.cy, 240.0f);
}

TEST_F(CameraInfoFile, IsReadBackUnchanged) {
  const CameraInfo written{17, 9, {1.0f / 3.0f, 525.1f, 8.25f, 4.7f}};
  const CameraInfo info = load(cameraInfoText(written, "any"));
  EXPECT_EQ(info.width, 17);
  EXPECT_EQ(info.height, 9);
  EXPECT_EQ(info.intrinsics.fx, written.intrinsics.fx);
  EXPECT_EQ(info.intrinsics.fy, written.intrinsics.fy);
  EXPECT_EQ(info.intrinsics.cx, written.intrinsics.cx);
  EXPECT_EQ(info.intrinsics.cy, written.intrinsics.cy);
}

TEST_F(CameraInfoFile, ErrorsNameFileAndKey) {
  const std::string size = kSize;
  const std::pair<std::string, std::string> cases[] = {
      {"", "no intrinsics"},
      {"- 1\n", "no intrinsics"},
      {size, "no projection_matrix"},
      {kCameraMatrix, "image_width"},
      {"image_width: 640\nimage_height: -1\n", "image_height"},
      {"image_width: [1]\n", "image_width"},
      {size + "camera_matrix: 5\n", "camera_matrix/data"},
      {size + "camera_matrix:\n  data: [1, 2, 3]\n", "list of 9 numbers"},
      {size + "camera_matrix:\n  data: [x, 0, 0, 0, 1, 0, 0, 0, 1]\n", "numbers only"},
      {size + "camera_matrix:\n  data: [0, 0, 0, 0, 1, 0, 0, 0, 1]\n", "focal lengths"},
      {size + "camera_matrix: [1, 2\n", "line"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string error = errorFor(text);
    EXPECT_NE(error.find(path_), std::string::npos) << text << "-> " << error;
    EXPECT_NE(error.find(expected), std::string::npos) << text << "-> " << error;
  }
  EXPECT_NE(errorOf([&] { loadCameraInfo(folder_ / "none.yaml"); }).find("no such file"),
            std::string::npos);
}

}  // namespace
}  // namespace dtsdf
