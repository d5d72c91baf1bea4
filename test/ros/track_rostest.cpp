/// Tests tracking with a bag that contains no transforms. The camera is tracked, lost when it is
/// covered, and found again.
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveTrajectory.h>
#include <dtsdf_mapping/SetPose.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "io/trajectory.h"
#include "ros/support/bag_player.h"
#include "ros/support/output_folder.h"
#include "ros/support/room_bags.h"
#include "ros/support/room_camera.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

/// Tolerances: half a voxel, and the corresponding angle at 2 m.
constexpr double kClose_m = 0.02, kClose_rad = 0.01;

/// Converts a camera pose in the room to one in the map. Tracking starts with an upright camera at
/// the map's origin.
Eigen::Isometry3d mapPose(const Eigen::Isometry3d& T_R_C) {
  Eigen::Isometry3d begin = Eigen::Isometry3d::Identity();
  begin.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return begin * room_bag::poseAt(0).inverse() * T_R_C;
}

/// All tests play the same bag. Each continues where the previous test ended.
class Track : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(waitUntil([&] { return status_.received() && way_.isConnected(); }));
  }

  /// Plays images `from` to `to` - 1 of the bag.
  static void play(int from, int to) {
    const BagPlayer player(room_bag::kPeriod_s * (from - 0.5), room_bag::kPeriod_s * (to - 0.5));
  }

  void expectAt(const Eigen::Isometry3d& T_R_C) const {
    EXPECT_LT(shiftBetween_m(way_.pose(), mapPose(T_R_C)), kClose_m);
    EXPECT_LT(turnBetween_rad(way_.pose(), mapPose(T_R_C)), kClose_rad);
  }

  /// Checks that all images are accounted for.
  void expectAccounted() const {
    const dtsdf_mapping::MapStatus& status = status_.status();
    EXPECT_EQ(status.images_received,
              status.frames_fused + status.frames_dropped + status.frames_waiting);
  }

  const dtsdf_mapping::PoseStatus& poseStatus() const {
    return status_.status().cameras.at(0).pose;
  }

  ros::NodeHandle nh_;
  StatusWatcher status_{nh_};
  OdometryWatcher way_{nh_};
  RoomCamera camera_{nh_};
};

TEST_F(Track, ACameraIsTrackedWithoutTransforms) {
  play(0, room_bag::kCarried);
  ASSERT_TRUE(way_.waitFor(room_bag::stampOf(room_bag::kCarried - 1))) << status_.status().message;
  ASSERT_TRUE(status_.waitForFused(room_bag::kCarried)) << status_.status().message;
  EXPECT_EQ(way_.odometry().header.frame_id, "odom");  // odom coincides with map
  EXPECT_EQ(way_.odometry().child_frame_id, "camera");
  expectAt(room_bag::poseAt(room_bag::kCarried - 1));
  for (size_t axis = 0; axis < 6; ++axis) {
    EXPECT_GT(way_.odometry().pose.covariance[7 * axis], 0.0);
    EXPECT_LT(way_.odometry().pose.covariance[7 * axis], 1e-4) << axis;
  }
  const auto T_M_C = way_.transform("map", "camera", room_bag::stampOf(room_bag::kCarried - 1));
  ASSERT_TRUE(T_M_C);
  EXPECT_LT(shiftBetween_m(*T_M_C, way_.pose()), 1e-6);
  EXPECT_EQ(poseStatus().outcome, "aligned");
  EXPECT_GT(poseStatus().inlier_share, 0.9f);
  EXPECT_LT(poseStatus().residual_m, 0.02f);
  EXPECT_TRUE(poseStatus().free_shifts.empty() && poseStatus().free_turns.empty());
  EXPECT_TRUE(poseStatus().lost_since.isZero());
  EXPECT_EQ(status_.status().message.substr(0, 7), "mapping");
  expectAccounted();
}

TEST_F(Track, ACoveredCameraIsLostAndFusesNothing) {
  const uint64_t fused = status_.status().frames_fused;
  play(room_bag::kCarried, room_bag::kCarried + room_bag::kCovered);
  ASSERT_TRUE(waitUntil([&] { return status_.dropped("lost") == room_bag::kCovered; }))
      << status_.status().message;
  EXPECT_EQ(status_.status().frames_fused, fused);
  EXPECT_NEAR((poseStatus().lost_since - room_bag::stampOf(room_bag::kCarried)).toSec(), 0.0, 1e-6);
  EXPECT_NE(status_.status().message.find("the camera is lost"), std::string::npos)
      << status_.status().message;
  EXPECT_EQ(status_.status().level, dtsdf_mapping::MapStatus::WARN);
  expectAccounted();
}

TEST_F(Track, TheCameraIsFoundAgainNearby) {
  const uint64_t fused = status_.status().frames_fused;
  constexpr int kEnd = room_bag::kCarried + room_bag::kCovered + room_bag::kHeld;
  play(room_bag::kCarried + room_bag::kCovered, kEnd);
  ASSERT_TRUE(way_.waitFor(room_bag::stampOf(kEnd - 1))) << poseStatus();
  ASSERT_TRUE(waitUntil([&] { return status_.status().frames_waiting == 0; }));
  expectAt(room_bag::heldPose());
  EXPECT_GT(status_.status().frames_fused, fused);
  EXPECT_LT(status_.status().frames_fused, fused + room_bag::kHeld)
      << "a single match should not be enough";
  EXPECT_TRUE(poseStatus().lost_since.isZero());
  EXPECT_TRUE(waitUntil([&] { return way_.path().poses.size() > 10; }));
  expectAccounted();
}

TEST_F(Track, TrackingContinuesFromASetPose) {
  dtsdf_mapping::SetPose call;
  call.request.pose.orientation.w = 3.0;
  ASSERT_TRUE(callService("/mapping/set_pose", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_NE(call.response.message.find("quaternion"), std::string::npos);

  Eigen::Isometry3d about = mapPose(room_bag::poseAt(0));
  const Eigen::Quaterniond q(about.linear());
  call.request.pose.position.x = about.translation().x() + 0.03;  // an inexact pose
  call.request.pose.orientation.w = q.w();
  call.request.pose.orientation.x = q.x();
  call.request.pose.orientation.y = q.y();
  call.request.pose.orientation.z = q.z();
  ASSERT_TRUE(callService("/mapping/set_pose", call));
  ASSERT_TRUE(call.response.success) << call.response.message;
  const ros::Time stamp = room_bag::stampOf(room_bag::kCarried + 60);
  camera_.see(room_bag::poseAt(0), stamp);
  ASSERT_TRUE(way_.waitFor(stamp)) << poseStatus();
  expectAt(room_bag::poseAt(0));
}

/// When the map is cleared, tracking continues from the last pose.
TEST_F(Track, TrajectoryIsSavedAndClearedWithTheMap) {
  ASSERT_TRUE(waitUntil([&] { return status_.status().frames_waiting == 0; }));
  dtsdf_mapping::SaveTrajectory call;
  call.request.file_name = "way.ply";
  ASSERT_TRUE(callService("/mapping/save_trajectory", call));
  EXPECT_FALSE(call.response.success);
  call.request.file_name = "way.txt";
  ASSERT_TRUE(callService("/mapping/save_trajectory", call));
  ASSERT_TRUE(call.response.success) << call.response.message;
  const Trajectory trajectory = readTrajectory(call.response.path, "");
  EXPECT_EQ(trajectory.poses().size(), call.response.poses);
  EXPECT_EQ(trajectory.poses().size(), status_.status().frames_fused);
  EXPECT_NEAR(trajectory.poses().front().stamp_s, room_bag::stampOf(0).toSec(), 1e-6);
  EXPECT_LT(shiftBetween_m(trajectory.poses()[room_bag::kCarried - 1].T_W_C,
                           mapPose(room_bag::poseAt(room_bag::kCarried - 1))),
            kClose_m);
  dtsdf_mapping::SaveMap save;
  save.request.file_name = "room.dtsdf";
  ASSERT_TRUE(callService("/mapping/save_map", save) && save.response.success);

  clearMap();
  ASSERT_TRUE(callService("/mapping/save_trajectory", call));
  EXPECT_FALSE(call.response.success) << "clearing the map should clear the trajectory";
  const ros::Time stamp = room_bag::stampOf(room_bag::kCarried + 61);
  camera_.see(room_bag::poseAt(0), stamp);
  ASSERT_TRUE(way_.waitFor(stamp)) << status_.status().message;
  expectAt(room_bag::poseAt(0));
}

/// A new node loads the saved map without knowing the camera's pose. The camera is held still,
/// upside down.
TEST_F(Track, TheCameraIsFoundAfterARestart) {
  ros::param::set("/mapping/map/load_file", outputFolder() + "/room.dtsdf");
  // A new node replaces the running node with the same name.
  const std::string command = std::string(DTSDF_MAPPING_NODE) +
                              " __name:=mapping depth/image_rect:=/camera/depth/image_rect "
                              "depth/camera_info:=/camera/depth/camera_info < /dev/null";
  FILE* const node = popen(command.c_str(), "r");
  ASSERT_NE(node, nullptr);
  ASSERT_TRUE(waitUntil(
      [&] { return status_.status().frames_fused == 0 && status_.status().message != ""; }));
  Eigen::Isometry3d T_R_C = room_bag::poseAt(room_bag::kCarried / 2);
  T_R_C.rotate(Eigen::AngleAxisd(3.14, Eigen::Vector3d::UnitZ()));
  T_R_C.translate(Eigen::Vector3d(0.05, 0.05, 0.2));
  constexpr double kTimeout_s = 90.0;
  ros::Time stamp = room_bag::stampOf(room_bag::kCarried + 90);
  const auto isFound = [&] {
    ros::WallDuration(0.1).sleep();
    camera_.see(T_R_C, stamp += ros::Duration(0.1));
    return way_.odometry().header.stamp > room_bag::stampOf(room_bag::kCarried + 90);
  };
  EXPECT_TRUE(waitUntil(isFound, kTimeout_s)) << poseStatus();
  expectAt(T_R_C);
  removeOutputFolder();
  EXPECT_EQ(std::system("rosnode kill /mapping"), 0);
  pclose(node);
}

}  // namespace
}  // namespace dtsdf
