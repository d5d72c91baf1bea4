/// Tests the parameter map/level. The frame `map` is tilted, because it is the room camera's frame
/// at time 0. The node publishes the levelled frame `map_level`.
#include <dtsdf_mapping/CorrectPoses.h>
#include <dtsdf_mapping/GetDistances.h>
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <gtest/gtest.h>
#include <sensor_msgs/Imu.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "io/trajectory.h"
#include "ros/support/blocks_watcher.h"
#include "ros/support/grid_reader.h"
#include "ros/support/messages.h"
#include "ros/support/wait.h"
#include "ros/support/wall_camera.h"
#include "simulation/scene.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// The pose of the room (z up) in the frame `map`.
Eigen::Isometry3d roomInMap() { return roomCameraPose(0.0).inverse(); }

class LevelTest : public WallCamera {
 protected:
  void SetUp() override {
    WallCamera::SetUp();
    listener_.emplace(transforms_);  // after SetUp(), which waits for the node to subscribe to /tf
  }

  /// Sends the room camera's image at `time_s`, and waits until it is fused or dropped.
  void sendRoom(double time_s) {
    const uint64_t done = status_.status().frames_fused + status_.status().frames_dropped;
    const Eigen::Isometry3d T_R_C = roomCameraPose(time_s);
    const ros::Time stamp = camera_.nextStamp();
    const sensor_msgs::Image image = makeImageMessage(
        makeHeader(stamp, "camera"), "32FC1", FakeCamera::kWidth, FakeCamera::kHeight,
        renderDepth(makeRoomScene(), FakeCamera::kIntrinsics, FakeCamera::kWidth,
                    FakeCamera::kHeight, T_R_C));
    camera_.sendPose(roomInMap() * T_R_C, stamp);
    sent_.push_back({stamp.toSec(), roomInMap() * T_R_C});
    camera_.send(image, camera_.info(stamp));
    EXPECT_TRUE(waitUntil(
        [&] { return status_.status().frames_fused + status_.status().frames_dropped > done; }));
  }

  /// The pose of the room in map_level, according to the published transform.
  Eigen::Isometry3d roomInLevel() {
    EXPECT_TRUE(
        waitUntil([&] { return transforms_.canTransform("map_level", "map", ros::Time(0)); }));
    return toIsometry(transforms_.lookupTransform("map_level", "map", ros::Time(0)).transform) *
           roomInMap();
  }

  /// Checks that the map is level to within max_deg and that its floor is at floor_m to within
  /// max_m.
  void expectLevel(double max_deg, double floor_m, double max_m) {
    const Eigen::Isometry3d T_W_R = roomInLevel();
    const Vector3d up_W = T_W_R.linear().col(2);
    EXPECT_GT(up_W.z(), 0.0);
    EXPECT_LT(std::hypot(up_W.x(), up_W.y()), max_deg * M_PI / 180.0);
    EXPECT_NEAR((T_W_R * roomCameraPose(0.0).translation()).z(),
                roomCameraPose(0.0).translation().z() + floor_m, max_m);
  }

  /// Checks that mesh, status and grid are published in map_level with the floor at floor_m.
  void expectMapAt(double floor_m) {
    const BlocksWatcher blocks(nh_);
    const GridReader grid(nh_);
    for (int i = 0; i < 4; ++i) sendRoom(0.2 * i);
    ASSERT_TRUE(waitUntil([&] { return blocks.state().triangles() > 100; }));
    EXPECT_EQ(blocks.state().frame(), "map_level");
    EXPECT_EQ(status_.status().header.frame_id, "map_level");
    double lowest_m = 100.0, highest_m = -100.0;
    for (const auto& corner : blocks.state().corners()) {
      lowest_m = std::min(lowest_m, corner[2]);
      highest_m = std::max(highest_m, corner[2]);
    }
    EXPECT_NEAR(lowest_m, floor_m, 0.05);
    EXPECT_LT(highest_m, floor_m + 2.7);
    EXPECT_TRUE(waitUntil([&] { return grid.grids() > 0; }));
    EXPECT_EQ(grid.grid().header.frame_id, "map_level");
    EXPECT_GT(grid.count(100), 10u);
  }

  dtsdf_mapping::GetDistances::Response ask(const std::string& frame, const Vector3d& p) {
    dtsdf_mapping::GetDistances call;
    call.request.header.frame_id = frame;
    call.request.points.resize(1);
    call.request.points[0].x = p.x();
    call.request.points[0].y = p.y();
    call.request.points[0].z = p.z();
    EXPECT_TRUE(callService("/mapping/get_distances", call));
    return call.response;
  }

  MapContents savedMap() {
    const auto saved = saveMapAs("level.dtsdf");
    EXPECT_TRUE(saved.success) << saved.message;
    return loadMap(saved.path);
  }

  std::string lastDrop() const { return status_.status().cameras.at(0).streams.at(0).last_drop; }

  /// Sends the unchanged poses in `map` as a correction. The levelled map must not move.
  void expectNothingIsCorrected() {
    saveTrajectory(sent_, outputFolder() + "/sent.txt");
    dtsdf_mapping::CorrectPoses call;
    call.request.file_name = "sent.txt";
    ASSERT_TRUE(callService("/mapping/correct_poses", call));
    EXPECT_TRUE(call.response.success) << call.response.message;
    EXPECT_EQ(call.response.moved, 0u) << call.response.message;
  }

  std::vector<StampedPose> sent_;
  tf2_ros::Buffer transforms_;
  std::optional<tf2_ros::TransformListener> listener_;
};

TEST_F(LevelTest, floor) {
  // The camera faces a wall, so no floor is found and no frame is fused.
  for (int i = 0; i < 12; ++i) {
    const uint64_t dropped = status_.dropped("not_level");
    camera_.sendFrame();
    ASSERT_TRUE(status_.waitForDrop("not_level", dropped));
  }
  EXPECT_EQ(status_.status().frames_fused, 0u);
  EXPECT_NE(lastDrop().find("hold the camera upright"), std::string::npos) << lastDrop();
  EXPECT_FALSE(transforms_.canTransform("map_level", "map", ros::Time(0)));
  const auto early = ask("camera", Vector3d::Zero());
  EXPECT_FALSE(early.success);
  EXPECT_NE(early.message.find("not levelled yet"), std::string::npos) << early.message;
  EXPECT_FALSE(savedMap().T_W_M) << "an empty map should have no levelling transform";

  // Each search for the floor uses ten images. The first search has failed, because only the wall
  // is visible. The second uses two images of the wall and eight of the room, so it may fail too.
  // The third uses only images of the room.
  for (int i = 0; i < 18 && status_.status().frames_fused == 0; ++i) sendRoom(0.1 * i);
  sendRoom(1.8);
  EXPECT_GE(status_.status().frames_fused, 1u);
  const uint64_t dropped = status_.dropped("not_level");
  expectLevel(0.3, 0.0, 0.01);
  expectMapAt(0.0);
  EXPECT_EQ(status_.dropped("not_level"), dropped);
  expectNothingIsCorrected();

  // The distance of a point does not depend on the frame in which its coordinates are given.
  const Vector3d p_R(1.2, 0.9, 0.3);
  const auto in_level = ask("map_level", roomInLevel() * p_R),
             in_map = ask("map", roomInMap() * p_R);
  ASSERT_TRUE(in_level.success) << in_level.message;
  ASSERT_TRUE(in_map.success) << in_map.message;
  EXPECT_NEAR(in_level.distances[0], in_map.distances[0], 0.01);
  EXPECT_EQ(ask("", roomInLevel() * p_R).distances, in_level.distances);
  const auto vectorOf = [](const geometry_msgs::Vector3& v) { return Vector3d(v.x, v.y, v.z); };
  EXPECT_LT(
      (vectorOf(in_level.gradients[0]) -
       roomInLevel().linear() * roomInMap().linear().transpose() * vectorOf(in_map.gradients[0]))
          .norm(),
      0.05);

  // The levelling transform of a loaded map replaces the one estimated by the node.
  const MapContents saved = savedMap();
  ASSERT_TRUE(saved.T_W_M);
  EXPECT_EQ(saved.map_frame, "map");
  MapContents moved = loadMap(outputFolder() + "/level.dtsdf");
  moved.T_W_M->translation().z() += 1.0;
  saveMap(moved, outputFolder() + "/moved.dtsdf");
  ASSERT_TRUE(loadMapFrom("moved.dtsdf").success);
  EXPECT_TRUE(waitUntil([&] { return (roomInLevel() * Vector3d::Zero()).z() > 0.9; }));
  clearMap();
  expectMapAt(1.0);

  // A map that is not levelled is refused.
  moved.T_W_M.reset();
  saveMap(moved, outputFolder() + "/plain.dtsdf");
  const auto loaded = loadMapFrom("plain.dtsdf");
  EXPECT_FALSE(loaded.success);
  EXPECT_NE(loaded.message.find("set map/level to none"), std::string::npos) << loaded.message;
}

TEST_F(LevelTest, imu) {
  for (int i = 0; i < 12; ++i) sendRoom(0.1 * i);
  EXPECT_EQ(status_.dropped("not_level"), 12u);
  EXPECT_NE(lastDrop().find("remap the topic imu"), std::string::npos) << lastDrop();

  ros::Publisher publisher = nh_.advertise<sensor_msgs::Imu>("/camera/imu", 1000);
  ASSERT_TRUE(waitUntil([&] { return publisher.getNumSubscribers() > 0; }));
  Eigen::Isometry3d T_M_I = Eigen::Isometry3d::Identity();
  T_M_I.linear() = Eigen::AngleAxisd(0.8, Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  const Vector3d up_I = T_M_I.linear().transpose() * roomInMap().linear().col(2);
  const auto sendImuForOneSecond = [&](double shake) {
    for (int i = 0; i < 130; ++i) {
      sensor_msgs::Imu imu;
      imu.header.stamp = ros::Time::now();
      imu.header.frame_id = "imu";
      const Vector3d a = (9.81 + (i % 2 == 0 ? shake : -shake)) * up_I;
      imu.linear_acceleration.x = a.x();
      imu.linear_acceleration.y = a.y();
      imu.linear_acceleration.z = a.z();
      camera_.sendPose(T_M_I, imu.header.stamp, "imu");
      publisher.publish(imu);
      ros::WallDuration(0.01).sleep();
    }
  };
  sendImuForOneSecond(2.0);
  sendRoom(0.0);
  EXPECT_NE(lastDrop().find("hold it still"), std::string::npos) << lastDrop();
  EXPECT_FALSE(transforms_.canTransform("map_level", "map", ros::Time(0)));

  sendImuForOneSecond(0.02);
  expectLevel(0.1, -roomCameraPose(0.0).translation().z(), 1e-6);
  EXPECT_TRUE(waitUntil([&] { return publisher.getNumSubscribers() == 0; }))
      << "the node should unsubscribe from the IMU once the map is levelled";
  sendRoom(0.0);
  EXPECT_EQ(status_.status().frames_fused, 1u);
  expectMapAt(-roomCameraPose(0.0).translation().z());
  ASSERT_TRUE(savedMap().T_W_M);
}

}  // namespace
}  // namespace dtsdf
