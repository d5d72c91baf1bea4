#include "io/tum_lists.h"

#include <gtest/gtest.h>

#include "support/tum_folder.h"

namespace dtsdf {
namespace {

class TumListsTest : public testing::Test {
 protected:
  void SetUp() override { writeTumFolder(folder_, 3); }

  std::string error() const {
    return errorOf([&] {
      readTumDepthList(folder_.path());
      readTumTrajectory(folder_.path());
      readTumCamera(folder_.path());
    });
  }

  TemporaryFolder folder_;
};

TEST_F(TumListsTest, ReadsListsPosesAndCamera) {
  const std::vector<StampedImage> depth = readTumDepthList(folder_.path());
  ASSERT_EQ(depth.size(), 3u);
  EXPECT_DOUBLE_EQ(depth[1].stamp_s, 100.1);
  EXPECT_EQ(depth[1].path, folder_ / "depth/1.png");
  EXPECT_TRUE(readTumColourList(folder_.path()).empty());
  const Trajectory trajectory = readTumTrajectory(folder_.path());
  ASSERT_EQ(trajectory.poses().size(), 3u);
  EXPECT_EQ(trajectory.poses()[2].T_W_C.translation().x(), 2.0);
  EXPECT_EQ(readTumCamera(folder_.path())->intrinsics.fy, 11.0f);
}

TEST_F(TumListsTest, ReadsPosesAsCameraToWorldWithTheScalarLast) {
  // A quarter turn about z maps the camera's x axis to the map's y axis.
  writeBytes(folder_ / "groundtruth.txt",
             "\xef\xbb\xbf# Windows\r\n100 1 2 3 0 0 0.7071 0.7071\r\n");
  const Trajectory trajectory = readTumTrajectory(folder_.path());
  const Eigen::Vector3d p_W = trajectory.poses().at(0).T_W_C * Eigen::Vector3d::UnitX();
  EXPECT_TRUE(p_W.isApprox(Eigen::Vector3d(1, 3, 3), 1e-9)) << p_W;
}

TEST_F(TumListsTest, ErrorsNameMissingFiles) {
  for (const char* name : {"camera_info.yaml", "groundtruth.txt", "depth.txt"}) {
    std::filesystem::remove(folder_ / name);
    EXPECT_NE(error().find(folder_ / name), std::string::npos) << error();
  }
}

TEST_F(TumListsTest, NamesFileAndLineOfInvalidPoses) {
  for (const char* line :
       {"100.0 0 0 0 0 0 0", "100.0 0 0 0 0 0 0 1 9", "100.0 x 0 0 0 0 0 1", "nan 0 0 0 0 0 0 1",
        "100.0 0 0 0 0 0 0 0", "100.0 0 0 0 0 0 0 2", "100.0 1e999 0 0 0 0 0 1"}) {
    writeBytes(folder_ / "groundtruth.txt", std::string("# comment\n\n") + line + "\n");
    EXPECT_NE(error().find(folder_ / "groundtruth.txt:3: "), std::string::npos)
        << line << " -> " << error();
  }
}

TEST_F(TumListsTest, NamesFileAndLineOfMalformedImageLines) {
  for (const char* line : {"100.0", "abc depth/0.png", "100.0 a b", "depth/0.png 100.0"}) {
    writeBytes(folder_ / "depth.txt", std::string(line) + "\n");
    EXPECT_NE(error().find(folder_ / "depth.txt:1: "), std::string::npos)
        << line << " -> " << error();
  }
  writeBytes(folder_ / "depth.txt", "# nothing\n");
  EXPECT_NE(error().find("lists no depth image"), std::string::npos) << error();
}

}  // namespace
}  // namespace dtsdf
