/// Tests that drifting odometry is corrected before images are fused, and that the correction is
/// published.
#include <dtsdf_mapping/SetPose.h>
#include <gtest/gtest.h>

#include "ros/support/bag_player.h"
#include "ros/support/room_bags.h"
#include "ros/support/room_camera.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

TEST(Refine, DriftIsCorrectedAndPublished) {
  ros::NodeHandle nh;
  const StatusWatcher status(nh);
  const OdometryWatcher way(nh);
  ASSERT_TRUE(waitUntil([&] { return status.received() && way.isConnected(); }));
  const BagPlayer player(0.0, room_bag::kPeriod_s * room_bag::kDriftingFrames);
  const ros::Time stamp = room_bag::stampOf(room_bag::kDriftingFrames - 1);
  const Eigen::Isometry3d T_R_B =
      room_bag::poseAt(room_bag::kDriftingFrames - 1) * mount().inverse();
  ASSERT_TRUE(way.waitFor(stamp)) << status.status().message;
  ASSERT_TRUE(status.waitForFused(room_bag::kDriftingFrames)) << status.status().message;
  EXPECT_EQ(way.count(), static_cast<size_t>(room_bag::kDriftingFrames));
  EXPECT_EQ(way.odometry().header.frame_id, "map");
  EXPECT_EQ(way.odometry().child_frame_id, "base");

  const Eigen::Isometry3d drift = room_bag::driftAt(room_bag::kDriftingFrames - 1);
  const double given_m = shiftBetween_m(drift.inverse() * T_R_B, T_R_B);
  const double given_rad = turnBetween_rad(drift, Eigen::Isometry3d::Identity());
  EXPECT_LT(shiftBetween_m(way.pose(), T_R_B), given_m / 4.0);
  EXPECT_LT(turnBetween_rad(way.pose(), T_R_B), given_rad / 4.0);
  // The correction lags behind the drift, because noise must first be ruled out.
  const auto T_M_B = way.transform("map", "base", stamp);
  ASSERT_TRUE(T_M_B);
  EXPECT_LT(shiftBetween_m(*T_M_B, T_R_B), given_m * 0.7);
  EXPECT_LT(turnBetween_rad(*T_M_B, T_R_B), given_rad * 0.7);

  const dtsdf_mapping::PoseStatus& pose = status.status().cameras.at(0).pose;
  EXPECT_EQ(pose.outcome, "aligned");
  EXPECT_EQ(pose.stamp, stamp);
  EXPECT_TRUE(pose.lost_since.isZero());
}

TEST(Refine, PosesCannotBeSet) {
  dtsdf_mapping::SetPose call;
  ASSERT_TRUE(callService("/mapping/set_pose", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_NE(call.response.message.find("poses/mode"), std::string::npos) << call.response.message;
}

}  // namespace
}  // namespace dtsdf
