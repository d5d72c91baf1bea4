/// Odometry that drifts: images are fused where they fit, and the drift is published.
#include <dtsdf_mapping/SetPose.h>
#include <gtest/gtest.h>

#include "ros/support/room_camera.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

constexpr double kRefinePeriod_s = 0.05;
constexpr int kRefinedFrames = 60;

/// Where the odometry's frame would have to lie in the room: it drifts by 9 cm and 3 degrees.
Eigen::Isometry3d driftAt(int frame) {
  const double share = static_cast<double>(frame) / kRefinedFrames;
  Eigen::Isometry3d T_R_O(Eigen::Translation3d(0.08 * share, -0.04 * share, 0.01 * share));
  T_R_O.rotate(Eigen::AngleAxisd(0.05 * share, Eigen::Vector3d::UnitZ()));
  return T_R_O;
}

TEST(Refine, DriftIsTakenOutAndPublished) {
  ros::NodeHandle nh;
  const StatusWatcher status(nh);
  const WayWatcher way(nh);
  RoomCamera camera(nh);
  ASSERT_TRUE(camera.connect());
  ASSERT_TRUE(waitUntil([&] { return status.received() && way.isConnected(); }));
  const ros::Time start = ros::Time::now();
  ros::Time stamp;
  Eigen::Isometry3d T_R_B;
  for (int i = 0; i < kRefinedFrames; ++i) {
    stamp = start + ros::Duration(kRefinePeriod_s * i);
    const Eigen::Isometry3d T_R_C = roomCameraPose(kRefinePeriod_s * i);
    T_R_B = T_R_C * mount().inverse();
    camera.sendTransform("odom", "base", driftAt(i).inverse() * T_R_B, stamp);
    camera.sendTransform("base", "camera", mount(), stamp);
    camera.see(T_R_C, stamp);
    if (i % 10 == 9) {
      ASSERT_TRUE(status.waitForFused(static_cast<uint64_t>(i - 9))) << status.status().message;
    }
  }
  ASSERT_TRUE(way.waitFor(stamp)) << status.status().message;
  ASSERT_TRUE(status.waitForFused(kRefinedFrames)) << status.status().message;
  EXPECT_EQ(way.count(), static_cast<size_t>(kRefinedFrames));
  EXPECT_EQ(way.odometry().header.frame_id, "map");
  EXPECT_EQ(way.odometry().child_frame_id, "base");

  const Eigen::Isometry3d drift = driftAt(kRefinedFrames - 1);
  const double given_m = shiftBetween_m(drift.inverse() * T_R_B, T_R_B);
  const double given_rad = turnBetween_rad(drift, Eigen::Isometry3d::Identity());
  EXPECT_LT(shiftBetween_m(way.pose(), T_R_B), given_m / 4.0);
  EXPECT_LT(turnBetween_rad(way.pose(), T_R_B), given_rad / 4.0);
  // The correction follows the drift, behind it by what it needs to see that it is no noise.
  const auto T_M_B = way.transform("map", "base", stamp);
  ASSERT_TRUE(T_M_B);
  EXPECT_LT(shiftBetween_m(*T_M_B, T_R_B), given_m * 0.7);
  EXPECT_LT(turnBetween_rad(*T_M_B, T_R_B), given_rad * 0.7);

  const dtsdf_mapping::PoseStatus& pose = status.status().cameras.at(0).pose;
  EXPECT_EQ(pose.outcome, "aligned");
  EXPECT_EQ(pose.stamp, stamp);
  EXPECT_TRUE(pose.lost_since.isZero());
}

TEST(Refine, NoPoseCanBeSet) {
  dtsdf_mapping::SetPose call;
  ASSERT_TRUE(ros::service::call("/mapping/set_pose", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_NE(call.response.message.find("poses/mode"), std::string::npos) << call.response.message;
}

}  // namespace
}  // namespace dtsdf
