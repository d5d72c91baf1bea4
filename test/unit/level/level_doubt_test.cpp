// Warnings about map frames whose z is not up.
#include "level/level_pose.h"

#include <gtest/gtest.h>

#include <string>

#include "simulation/scene.h"
#include "support/depth_frames.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// What is doubtful of a camera at T_W_C that looks at a scene from T_R_C.
std::string doubt(const Scene& scene, const Eigen::Isometry3d& T_R_C,
                  const Eigen::Isometry3d& T_W_C) {
  SceneFrame frame = renderFrame(scene, T_R_C);
  frame.frame.T_W_C = T_W_C;
  LevelDoubt doubt;
  for (size_t i = 0; i < FloorSearch::kViews; ++i) {
    EXPECT_TRUE(doubt.text().empty());
    EXPECT_EQ(doubt.add(frame.view()), i + 1 == FloorSearch::kViews);
  }
  EXPECT_FALSE(doubt.add(frame.view())) << "only once";
  return doubt.text();
}

Scene wallAhead() {
  Scene scene;
  scene.add(Plane{Vector3d(2.0, 0.0, 0.0), -Vector3d::UnitX()});
  return scene;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(LevelDoubt, IsAboutTheFloorWhereThereIsOne) {
  const Eigen::Isometry3d T_R_C = roomCameraPose(0.0);
  EXPECT_EQ(doubt(makeRoomScene(), T_R_C, T_R_C), "");
  Eigen::Isometry3d tilt = Eigen::Isometry3d::Identity();
  tilt.linear() = Eigen::AngleAxisd(0.0523, Vector3d::UnitY()).toRotationMatrix();
  EXPECT_EQ(doubt(makeRoomScene(), T_R_C, tilt * T_R_C), "") << "3 degrees";
  tilt.linear() = Eigen::AngleAxisd(0.3491, Vector3d::UnitY()).toRotationMatrix();
  EXPECT_TRUE(has(doubt(makeRoomScene(), T_R_C, tilt * T_R_C), "20 degrees from level"));
  const std::string of_first = doubt(makeRoomScene(), T_R_C, Eigen::Isometry3d::Identity());
  EXPECT_TRUE(has(of_first, "degrees from level")) << of_first;
  EXPECT_TRUE(has(of_first, "map/level")) << of_first;
}

TEST(LevelDoubt, IsAboutTheCameraWhereThereIsNoFloor) {
  const Eigen::Isometry3d ahead =
      lookAt(Vector3d(0.0, 0.0, 1.0), Vector3d(2.0, 0.0, 1.0), Vector3d::UnitZ());
  EXPECT_EQ(doubt(wallAhead(), ahead, ahead), "");
  EXPECT_TRUE(has(doubt(wallAhead(), ahead, Eigen::Isometry3d::Identity()), "looks along z"));
  Eigen::Isometry3d z_down = Eigen::Isometry3d::Identity();
  z_down.linear() = Eigen::AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix();
  EXPECT_TRUE(has(doubt(wallAhead(), ahead, z_down * ahead), "upside down"));
}

TEST(LevelDoubt, IsNoneAboutACameraThatLooksDown) {
  Scene ground;
  ground.add(Plane{Vector3d::Zero(), Vector3d::UnitZ()});
  const Eigen::Isometry3d down =
      lookAt(Vector3d(0.0, 0.0, 2.0), Vector3d::Zero(), Vector3d::UnitX());
  EXPECT_EQ(doubt(ground, down, down), "");
}

}  // namespace
}  // namespace dtsdf
