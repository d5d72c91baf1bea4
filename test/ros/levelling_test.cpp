#include "ros/session/levelling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <variant>
#include <vector>

#include "level/level_pose.h"
#include "ros/support/transforms.h"
#include "simulation/scene.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

class LevellingTest : public testing::Test {
 protected:
  Levelling make(LevelChoice from, bool space = false) {
    MappingParams params;
    params.node.level.from = from;
    params.mapper.space.enabled = space;
    return Levelling(params, poses_,
                     [this](const Eigen::Isometry3d& T_W_M) { announced_.push_back(T_W_M); });
  }

  /// What a camera at T_R_C in the room sees, whose map frame is the first camera.
  PosedFrame frameAt(double time_s) {
    const Intrinsics K{60.0f, 60.0f, 31.5f, 23.5f};
    const Eigen::Isometry3d T_R_C = roomCameraPose(time_s);
    depth_m_ = renderDepth(makeRoomScene(), K, 64, 48, T_R_C);
    DepthFrame depth;
    depth.data = depth_m_.data();
    depth.row_bytes = 64 * sizeof(float);
    depth.width = 64;
    depth.height = 48;
    depth.encoding = DepthEncoding::kFloat32;
    depth.unit_m = 1.0f;
    depth.intrinsics = K;
    depth.T_W_C = roomCameraPose(0.0).inverse() * T_R_C;
    PosedFrame frame;
    frame.image = depth;
    return frame;
  }

  static Eigen::Isometry3d poseOf(const PosedFrame& frame) {
    return std::visit([](const auto& image) { return image.T_W_C; }, frame.image);
  }

  /// One at rest, in a frame in which up is y.
  static sensor_msgs::Imu atRest(double stamp_s) {
    sensor_msgs::Imu imu;
    imu.header.stamp = ros::Time(stamp_s);
    imu.header.frame_id = "/imu";
    imu.linear_acceleration.y = 9.8;
    return imu;
  }

  TransformBuffer transforms_;
  PoseSource poses_{transforms_, "map"};
  std::vector<Eigen::Isometry3d> announced_;
  std::vector<float> depth_m_;
};

TEST_F(LevellingTest, NoneLeavesPosesAsTheyAre) {
  for (const bool space : {false, true}) {
    Levelling none = make(LevelChoice::kNone, space);
    EXPECT_FALSE(none.isOn());
    EXPECT_TRUE(none.isKnown());
    for (int i = 0; i < 12; ++i) {
      PosedFrame frame = frameAt(0.1 * i);
      const Eigen::Isometry3d before = poseOf(frame);
      EXPECT_TRUE(none.bring(frame));
      EXPECT_EQ(poseOf(frame).matrix(), before.matrix());
    }
    EXPECT_FALSE(none.level());
    EXPECT_EQ(none.inMap(poseOf(frameAt(0.5))).matrix(), poseOf(frameAt(0.5)).matrix());
    none.add(atRest(1.0));
    EXPECT_FALSE(none.level());
  }
  EXPECT_TRUE(announced_.empty());
}

TEST_F(LevellingTest, FloorIsFoundBeforeTheFirstFrameIsFused) {
  Levelling levelling = make(LevelChoice::kFloor);
  PosedFrame colour;
  colour.image = ColourFrame();
  for (size_t i = 0; i < FloorSearch::kViews; ++i) {
    EXPECT_FALSE(levelling.bring(colour)) << "colour waits, too";
    EXPECT_FALSE(levelling.isKnown());
    EXPECT_FALSE(levelling.problem().empty());
    EXPECT_THROW(levelling.inMap(Eigen::Isometry3d::Identity()), std::runtime_error);
    PosedFrame frame = frameAt(0.1 * static_cast<double>(i));
    EXPECT_FALSE(levelling.bring(frame));
  }
  ASSERT_EQ(announced_.size(), 1u);
  EXPECT_TRUE(levelling.isKnown());
  EXPECT_EQ(levelling.problem(), "");
  PosedFrame frame = frameAt(1.0);
  const Eigen::Isometry3d T_M_C = poseOf(frame);
  ASSERT_TRUE(levelling.bring(frame));
  EXPECT_EQ(poseOf(frame).matrix(), (announced_[0] * T_M_C).matrix());
  EXPECT_NEAR(poseOf(frame).translation().z(), roomCameraPose(1.0).translation().z(), 0.005);
  EXPECT_EQ(levelling.level()->matrix(), announced_[0].matrix());
  EXPECT_TRUE(levelling.bring(colour));
  EXPECT_EQ(poseOf(colour).matrix(), announced_[0].matrix());
}

TEST_F(LevellingTest, ALoadedMapBringsItsOwn) {
  Levelling levelling = make(LevelChoice::kFloor);
  const Eigen::Isometry3d T_W_M = levelPose(Vector3d(0.0, -1.0, 0.2).normalized(), 0.7);
  levelling.set(T_W_M);
  PosedFrame frame = frameAt(0.0);
  ASSERT_TRUE(levelling.bring(frame)) << "no floor is looked for any more";
  EXPECT_TRUE(poseOf(frame).isApprox(T_W_M, 1e-12));
  ASSERT_EQ(announced_.size(), 1u);
}

TEST_F(LevellingTest, ImuIsTurnedIntoTheMapFrame) {
  Levelling levelling = make(LevelChoice::kImu);
  const Eigen::Isometry3d T(Eigen::AngleAxisd(M_PI / 2.0, Vector3d::UnitZ()));  // y is -x
  PosedFrame frame = frameAt(0.0);
  for (int i = 0; i <= 100; ++i) {
    EXPECT_FALSE(levelling.bring(frame));
    levelling.add(atRest(10.0 + 0.01 * i));
  }
  EXPECT_FALSE(levelling.isKnown()) << "there is no transform yet";
  EXPECT_NE(levelling.problem().find("no transform from 'imu'"), std::string::npos)
      << levelling.problem();
  for (const double stamp_s : {10.5, 11.5}) {
    transforms_.setTransform(makeTransform("map", "imu", T, ros::Time(stamp_s)), "test");
  }
  levelling.add(atRest(11.02));
  ASSERT_TRUE(levelling.isKnown());
  EXPECT_TRUE((levelling.level()->linear() * -Vector3d::UnitX()).isApprox(Vector3d::UnitZ(), 1e-9));
  EXPECT_EQ(levelling.level()->translation().norm(), 0.0) << "gravity says nothing of the floor";
  EXPECT_TRUE(levelling.bring(frame));
}

TEST_F(LevellingTest, ImuWithoutAccelerationIsRefused) {
  Levelling levelling = make(LevelChoice::kImu);
  sensor_msgs::Imu imu = atRest(1.0);
  imu.linear_acceleration_covariance[0] = -1.0;
  levelling.add(imu);
  EXPECT_NE(levelling.problem().find("no acceleration"), std::string::npos);
  levelling.add(atRest(0.0));
  EXPECT_NE(levelling.problem().find("no stamp"), std::string::npos);
}

}  // namespace
}  // namespace dtsdf
