#include "evaluation/tsdf_fusion_folder.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "evaluation/depth_renderer.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

/// Turned by a right angle about z.
const char* const kPose = "0 -1 0 0.5\n1 0 0 -2\n0 0 1 3\n0 0 0 1\n";

void writeFrame(const TemporaryFolder& folder, const std::string& name, const std::string& pose) {
  cv::Mat image(2, 3, CV_16UC1, cv::Scalar(0));
  image.at<uint16_t>(0, 1) = 1234;
  image.at<uint16_t>(1, 2) = 65535;
  cv::imwrite(folder / (name + ".depth.png"), image);
  writeBytes(folder / (name + ".pose.txt"), pose);
}

TEST(TsdfFusionFolder, ReadsPosesInOrderAndLeavesOutLostOnes) {
  const TemporaryFolder folder;
  writeFrame(folder, "frame-000010", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  writeFrame(folder, "frame-000009", kPose);
  writeFrame(folder, "frame-000011", "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  writeFrame(folder, "frame-000012", "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n");
  const TsdfFusionFolder found = readTsdfFusionFolder(folder.path());
  ASSERT_EQ(found.frames.size(), 2u);
  EXPECT_EQ(found.without_pose, 2u);
  const Eigen::Vector3d p_W = found.frames[0].T_W_C * Eigen::Vector3d(1, 0, 0);
  EXPECT_TRUE(p_W.isApprox(Eigen::Vector3d(0.5, -1, 3), 1e-9));
}

TEST(TsdfFusionFolder, DepthIsInMillimetres) {
  const TemporaryFolder folder;
  writeFrame(folder, "frame-000000", kPose);
  const std::string path = readTsdfFusionFolder(folder.path()).frames[0].depth_path;
  const ViewCamera camera = cameraForImage(path, {600, 600, 1, 1});
  ASSERT_EQ(camera.width, 3);
  ASSERT_EQ(camera.height, 2);
  EXPECT_EQ(toTumDepth(readMillimetres(path, camera)),
            (std::vector<uint16_t>{0, 6170, 0, 0, 0, 0}));
}

TEST(TsdfFusionFolder, TellsWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_NE(errorOf([&] { readTsdfFusionFolder(folder.path()); }).find("no frame"),
            std::string::npos);
  writeFrame(folder, "frame-000000", "1 0 0");
  EXPECT_NE(errorOf([&] { readTsdfFusionFolder(folder.path()); }).find("4 x 4"),
            std::string::npos);
}

}  // namespace
}  // namespace dtsdf
