#include "ros/steps/level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <variant>
#include <vector>

#include "level/level_pose.h"
#include "ros/support/transforms.h"
#include "simulation/scene.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

class LevelTest : public testing::Test {
 protected:
  void make(LevelChoice from) {
    params_.level = from;
    step_ = std::make_unique<LevelStep>(params_, transforms_, frame_);
  }

  bool place(PosedFrame& frame) { return !step_->place(frame); }

  /// Image from the room camera at `time_s`. The map frame is the camera's frame at time 0.
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

  /// An IMU sample at rest, with y pointing up.
  static sensor_msgs::Imu atRest(double stamp_s) {
    sensor_msgs::Imu imu;
    imu.header.stamp = ros::Time(stamp_s);
    imu.header.frame_id = "/imu";
    imu.linear_acceleration.y = 9.8;
    return imu;
  }

  NodeParams params_;
  Transforms transforms_;
  MapFrame frame_{params_, transforms_};
  std::unique_ptr<LevelStep> step_;
  std::vector<float> depth_m_;
};

TEST_F(LevelTest, NoneLeavesPosesUnchanged) {
  make(LevelChoice::kNone);
  EXPECT_FALSE(frame_.isLevelled());
  for (int i = 0; i < 12; ++i) {
    PosedFrame frame = frameAt(0.1 * i);
    const Eigen::Isometry3d before = poseOf(frame);
    EXPECT_TRUE(place(frame));
    EXPECT_EQ(poseOf(frame).matrix(), before.matrix());
  }
  EXPECT_FALSE(frame_.level());
  EXPECT_EQ(frame_.inMap(poseOf(frameAt(0.5))).matrix(), poseOf(frameAt(0.5)).matrix());
}

TEST_F(LevelTest, FloorIsFoundBeforeTheFirstFrameIsFused) {
  make(LevelChoice::kFloor);
  PosedFrame colour;
  colour.image = ColourFrame();
  for (size_t i = 0; i < FloorSearch::kViews; ++i) {
    EXPECT_FALSE(place(colour)) << "colour frames should be refused until the map is levelled";
    EXPECT_FALSE(frame_.level().has_value());
    EXPECT_FALSE(step_->problem().empty());
    EXPECT_THROW(frame_.inMap(Eigen::Isometry3d::Identity()), std::runtime_error);
    PosedFrame frame = frameAt(0.1 * static_cast<double>(i));
    EXPECT_FALSE(place(frame));
  }
  EXPECT_TRUE(frame_.level().has_value());
  PosedFrame frame = frameAt(1.0);
  const Eigen::Isometry3d T_M_C = poseOf(frame);
  ASSERT_TRUE(place(frame));
  EXPECT_EQ(poseOf(frame).matrix(), (*frame_.level() * T_M_C).matrix());
  EXPECT_NEAR(poseOf(frame).translation().z(), roomCameraPose(1.0).translation().z(), 0.005);
  EXPECT_TRUE(place(colour));
  EXPECT_EQ(poseOf(colour).matrix(), frame_.level()->matrix());
}

TEST_F(LevelTest, ALoadedMapProvidesItsLevel) {
  make(LevelChoice::kFloor);
  const Eigen::Isometry3d T_W_M = levelPose(Vector3d(0.0, -1.0, 0.2).normalized(), 0.7);
  MapContents loaded;
  loaded.T_W_M = T_W_M;
  step_->replaced(&loaded, nullptr);
  PosedFrame frame = frameAt(0.0);
  ASSERT_TRUE(place(frame)) << "the search for the floor should end";
  EXPECT_TRUE(poseOf(frame).isApprox(T_W_M, 1e-12));
}

TEST_F(LevelTest, ImuIsRotatedIntoTheMapFrame) {
  make(LevelChoice::kImu);
  const Eigen::Isometry3d T(Eigen::AngleAxisd(
      M_PI / 2.0, Vector3d::UnitZ()));  // the sensor's y axis is the map's -x axis
  PosedFrame frame = frameAt(0.0);
  for (int i = 0; i <= 100; ++i) {
    EXPECT_FALSE(place(frame));
    step_->add(atRest(10.0 + 0.01 * i));
  }
  EXPECT_FALSE(frame_.level().has_value()) << "levelling should need a transform";
  EXPECT_NE(step_->problem().find("no transform from 'imu'"), std::string::npos)
      << step_->problem();
  for (const double stamp_s : {10.5, 11.5}) {
    transforms_.take(makeTransform("map", "imu", T, ros::Time(stamp_s)), "test");
  }
  step_->add(atRest(11.02));
  ASSERT_TRUE(frame_.level().has_value());
  EXPECT_TRUE((frame_.level()->linear() * -Vector3d::UnitX()).isApprox(Vector3d::UnitZ(), 1e-9));
  EXPECT_EQ(frame_.level()->translation().norm(), 0.0) << "gravity should not change the height";
  EXPECT_TRUE(place(frame));
}

TEST_F(LevelTest, ImuWithoutAccelerationIsRefused) {
  make(LevelChoice::kImu);
  sensor_msgs::Imu imu = atRest(1.0);
  imu.linear_acceleration_covariance[0] = -1.0;
  step_->add(imu);
  EXPECT_NE(step_->problem().find("no acceleration"), std::string::npos);
  step_->add(atRest(0.0));
  EXPECT_NE(step_->problem().find("no stamp"), std::string::npos);
}

}  // namespace
}  // namespace dtsdf
