/// Tests that the grid, slices and distances provided for planners are correct and follow the map.
#include <dtsdf_mapping/ClearRegion.h>
#include <dtsdf_mapping/GetDistanceGrid.h>
#include <dtsdf_mapping/GetDistances.h>
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_srvs/SetBool.h>

#include <chrono>
#include <cmath>
#include <future>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "ros/input/conversions.h"
#include "ros/support/grid_reader.h"
#include "ros/support/raw_listener.h"
#include "ros/support/wait.h"
#include "ros/support/wall_camera.h"

namespace dtsdf {
namespace {

using dtsdf_mapping::GetDistances;

constexpr double kCell_m = 0.05;

/// Pose of an upright camera at x_m facing along the map's x axis. The wall is 1 m ahead.
Eigen::Isometry3d lookAlongX(double x_m) {
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T_W_C.translation().x() = x_m;
  return T_W_C;
}

/// The first message received by a new subscriber.
template <class Message>
Message firstMessage(const std::string& topic) {
  const auto message = listenRaw<Message>(topic).template readMessage<Message>(10.0);
  EXPECT_TRUE(message) << topic;
  return message.value_or(Message());
}

geometry_msgs::Point pointOf(double x, double y, double z) {
  geometry_msgs::Point point;
  point.x = x;
  point.y = y;
  point.z = z;
  return point;
}

GetDistances::Response ask(const GetDistances::Request& request) {
  GetDistances call;
  call.request = request;
  EXPECT_TRUE(callService("/mapping/get_distances", call));
  return call.response;
}

class SpaceTest : public WallCamera {
 protected:
  void setSpaceRate(double rate_hz) {
    dynamic_reconfigure::Reconfigure call;
    call.request.config.doubles.resize(1);
    call.request.config.doubles[0].name = "space_rate_hz";
    call.request.config.doubles[0].value = rate_hz;
    ASSERT_TRUE(callService("/mapping/publish/set_parameters", call));
  }

  /// Repeats the query until the answer includes the last frame.
  GetDistances::Response queryUpToDate(const GetDistances::Request& request) {
    GetDistances::Response response;
    EXPECT_TRUE(waitUntil([&] {
      response = ask(request);
      return response.success && response.stamp >= last_stamp_;
    })) << response.message;
    return response;
  }

  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(WallCamera::SetUp());
    clearMap();
  }

  /// Fuses frames from x_m plus 0.02 m, so that the wall is near the centre of a cell.
  void fuseFrames(int count, double x_m = 0.0) {
    for (int i = 0; i < count; ++i) {
      const uint64_t fused = status_.status().frames_fused;
      const ros::Time stamp = last_stamp_ = camera_.nextStamp();
      camera_.sendPose(lookAlongX(x_m + 0.02), stamp);
      camera_.send(camera_.image(stamp), camera_.info(stamp));
      ASSERT_TRUE(status_.waitForFused(fused + 1)) << status_.status().message;
    }
  }

  /// Waits until no grid has arrived for half a second. Returns the number of grids received.
  static size_t settledGrids(const GridReader& reader) {
    size_t grids = 0;
    ros::WallTime since = ros::WallTime::now();
    EXPECT_TRUE(waitUntil([&] {
      if (reader.grids() != grids) since = ros::WallTime::now();
      grids = reader.grids();
      return (ros::WallTime::now() - since).toSec() > 0.5;
    }));
    return grids;
  }

  /// Waits until the reader's grid equals that of a new subscriber.
  void expectUpToDate(const GridReader& reader) {
    nav_msgs::OccupancyGrid grid;
    EXPECT_TRUE(waitUntil([&] {
      grid = firstMessage<nav_msgs::OccupancyGrid>("/mapping/occupancy_grid");
      return grid.info.width == reader.grid().info.width && grid.data == reader.grid().data;
    }));
    EXPECT_EQ(grid.info.origin.position.x, reader.grid().info.origin.position.x);
    EXPECT_EQ(reader.misplaced(), 0u);
  }

  ros::Time last_stamp_;  ///< Stamp of the last fused frame.
};

/// Queries points in the frame of a robot with the wall on its right.
TEST_F(SpaceTest, AFootprintCanBeQueried) {
  fuseFrames(3);
  Eigen::Isometry3d T_W_B(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  T_W_B.translation() = Eigen::Vector3d(0.6, 0.0, 0.0);
  const ros::Time stamp = camera_.nextStamp();
  camera_.sendPose(T_W_B, stamp, "robot");
  GetDistances::Request request;
  request.header.frame_id = "robot";
  request.points = {pointOf(0.1, 0.1, 0.0), pointOf(0.1, -0.15, 0.0), pointOf(0.0, 0.0, 0.0),
                    pointOf(0.0, -1.0, 0.0)};
  for (const ros::Time& time : {stamp, ros::Time(0)}) {
    request.header.stamp = time;
    const GetDistances::Response response = queryUpToDate(request);
    ASSERT_EQ(response.known.size(), 4u);
    ASSERT_EQ(response.distances.size(), 4u);
    ASSERT_EQ(response.gradients.size(), 4u);
    // The wall is at x = 1.02 m in the map, so at y = -0.42 m in the robot's frame.
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_TRUE(response.known[i]) << i;
      EXPECT_NEAR(response.distances[i], 0.42 + request.points[i].y, 1.0 * kCell_m) << i;
      EXPECT_NEAR(response.gradients[i].y, 1.0, 0.05) << i;
      EXPECT_NEAR(response.gradients[i].x, 0.0, 0.05) << i;
    }
    EXPECT_FALSE(response.known[3]) << "cells behind the wall should be unknown";
    EXPECT_LT(response.distances[3], 0.0f);
  }
}

TEST_F(SpaceTest, BadRequestsAreRefusedWithAReason) {
  GetDistances::Request good;
  good.points = {pointOf(0.5, 0.0, 0.0)};
  const auto expectRefused = [](const GetDistances::Request& request, const std::string& why) {
    const GetDistances::Response response = ask(request);
    EXPECT_FALSE(response.success);
    EXPECT_NE(response.message.find(why), std::string::npos) << response.message;
    EXPECT_TRUE(response.distances.empty());
  };
  expectRefused(good, "nothing is mapped yet");
  fuseFrames(2);
  EXPECT_TRUE(queryUpToDate(good).success);
  GetDistances::Request bad = good;
  bad.header.frame_id = "nowhere";
  expectRefused(bad, "'nowhere'");
  bad.header.stamp = ros::Time::now();
  expectRefused(bad, "'nowhere'");
  bad = good;
  bad.points.push_back(pointOf(0.0, std::numeric_limits<double>::quiet_NaN(), 0.0));
  expectRefused(bad, "point is not finite");
  bad.points.assign(10000000, pointOf(0.5, 0.0, 0.0));
  expectRefused(bad, "10000000 points");
  bad.points.assign(100000, pointOf(0.5, 0.0, 0.0));
  const GetDistances::Response many = ask(bad);
  EXPECT_TRUE(many.success) << many.message;
  EXPECT_EQ(many.distances.size(), 100000u);
  // Even points very far away can be queried.
  good.points = {pointOf(1e300, -1e300, 0.0)};
  const GetDistances::Response far = ask(good);
  ASSERT_TRUE(far.success) << far.message;
  EXPECT_FALSE(far.known[0]);
}

/// The query's transform never arrives, so the query waits for input/tf_timeout_s.
TEST_F(SpaceTest, OthersAreServedWhileAQueryWaits) {
  ros::ServiceClient pauses = nh_.serviceClient<std_srvs::SetBool>("/mapping/pause", true);
  ros::ServiceClient distances = nh_.serviceClient<GetDistances>("/mapping/get_distances", true);
  GetDistances query;
  ASSERT_TRUE(distances.call(query));  // connected from here on
  query.request.header.frame_id = "nowhere";
  query.request.header.stamp = ros::Time::now() + ros::Duration(5.0);
  std::future<bool> answered =
      std::async(std::launch::async, [&] { return distances.call(query); });
  int served = 0;
  std_srvs::SetBool pause;  // data = false: does not pause
  while (answered.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    ASSERT_TRUE(pauses.call(pause));
    ++served;
  }
  EXPECT_TRUE(answered.get());
  EXPECT_NE(query.response.message.find("'nowhere'"), std::string::npos);
  EXPECT_GE(served, 10);
}

/// The wall is at x = 1.02 m. The request clears a sphere, as a planner may do for the robot's own
/// arm.
TEST_F(SpaceTest, AGridCanBeQueried) {
  fuseFrames(3);
  GetDistances::Request points;
  points.points = {pointOf(0.8, 0.0, 0.0)};
  ASSERT_TRUE(queryUpToDate(points).success);
  dtsdf_mapping::GetDistanceGrid call;
  auto& request = call.request;
  const auto& answer = call.response;
  request.box.pose.position = pointOf(0.8, 0.0, 0.0);
  request.box.size.x = 0.9;
  request.box.size.y = request.box.size.z = 0.1;
  request.resolution = 0.1;
  ASSERT_TRUE(callService("/mapping/get_distance_grid", call));
  ASSERT_TRUE(answer.success) << answer.message;
  EXPECT_EQ(answer.stamp, last_stamp_);
  EXPECT_EQ(std::vector<uint32_t>(answer.size.begin(), answer.size.end()),
            (std::vector<uint32_t>{9, 1, 1}));
  EXPECT_NEAR(answer.origin.position.x, 0.4, 1e-9);
  ASSERT_EQ(answer.distances.size(), 9u);
  ASSERT_EQ(answer.gradients.size(), 27u);
  EXPECT_EQ(answer.distances[4], queryUpToDate(points).distances[0]);
  EXPECT_NEAR(answer.distances[2], 1.02 - 0.6, kCell_m);
  EXPECT_NEAR(answer.gradients[6], -1.0, 0.05);
  EXPECT_TRUE(std::isnan(answer.distances[8])) << "cells behind the wall should be unknown";
  EXPECT_TRUE(std::isnan(answer.gradients[24]));

  request.cleared_spheres.resize(1);
  request.cleared_spheres[0].center = pointOf(1.02, 0.0, 0.0);
  request.cleared_spheres[0].radius = 0.3;
  ASSERT_TRUE(callService("/mapping/get_distance_grid", call));
  ASSERT_TRUE(answer.success) << answer.message;
  EXPECT_NEAR(answer.distances[4], std::hypot(0.22, 0.3), kCell_m);
  EXPECT_FALSE(std::isnan(answer.distances[8])) << "the cleared sphere should count as free";
  EXPECT_NEAR(queryUpToDate(points).distances[0], 0.22, kCell_m);

  request.cleared_boxes.resize(1000);
  ASSERT_TRUE(callService("/mapping/get_distance_grid", call));
  EXPECT_FALSE(answer.success);
  EXPECT_NE(answer.message.find("at most 1000"), std::string::npos) << answer.message;

  request.cleared_boxes.clear();
  request.resolution = 0.001;
  ASSERT_TRUE(callService("/mapping/get_distance_grid", call));
  EXPECT_FALSE(answer.success);
  EXPECT_NE(answer.message.find("2097152 points"), std::string::npos) << answer.message;
}

/// Responses are based on the last regular mesh update. If each query updated the mesh, there would
/// be as many stamps as frames.
TEST_F(SpaceTest, QueriesDoNotUpdateTheMesh) {
  setSpaceRate(1.0);
  GetDistances::Request request;
  request.points = {pointOf(0.5, 0.0, 0.0)};
  fuseFrames(1);
  ros::Time newest = queryUpToDate(request).stamp;
  const ros::WallTime begin = ros::WallTime::now();
  std::set<ros::Time> stamps;
  for (int i = 0; i < 40; ++i) {
    fuseFrames(1);
    const GetDistances::Response response = ask(request);
    ASSERT_TRUE(response.success) << response.message;
    EXPECT_GE(response.stamp, newest);
    EXPECT_LE(response.stamp, last_stamp_);
    newest = response.stamp;
    stamps.insert(newest);
  }
  const double seconds = (ros::WallTime::now() - begin).toSec();
  EXPECT_LE(static_cast<double>(stamps.size()), 2.0 + 2.0 * seconds);
  setSpaceRate(20.0);
  EXPECT_EQ(queryUpToDate(request).stamp, last_stamp_);
}

TEST_F(SpaceTest, UpdatesMatchTheGridOfLateSubscribers) {
  const GridReader reader(nh_);
  fuseFrames(3);
  ASSERT_TRUE(waitUntil([&] { return reader.at(1.02, 0.0) == 100; }));
  EXPECT_NEAR(reader.grid().info.resolution, kCell_m, 1e-6);
  EXPECT_EQ(reader.grid().info.width % 256, 0u);
  EXPECT_EQ(reader.grid().info.height % 256, 0u);
  EXPECT_EQ(reader.grid().header.frame_id, "map");
  EXPECT_EQ(reader.at(0.5, 0.0), 0);
  EXPECT_EQ(reader.at(1.3, 0.0), -1) << "cells behind the wall should be unknown";
  EXPECT_EQ(reader.at(0.5, 0.6), -1) << "cells outside the field of view should be unknown";
  expectUpToDate(reader);

  // Changes inside the grid are published as updates.
  size_t grids = settledGrids(reader);
  fuseFrames(3, 3.0);
  ASSERT_TRUE(waitUntil([&] { return reader.at(4.02, 0.0) == 100 && reader.at(3.5, 0.0) == 0; }));
  EXPECT_EQ(reader.grids(), grids);
  expectUpToDate(reader);

  // If a cell outside the grid changes, the grid grows in steps of 256 cells.
  const uint32_t width = reader.grid().info.width;
  grids = settledGrids(reader);
  fuseFrames(3, 13.0);
  ASSERT_TRUE(waitUntil([&] { return reader.at(14.02, 0.0) == 100; }));
  EXPECT_EQ(reader.grid().info.width, width + 256);
  EXPECT_EQ(reader.grids(), grids + 1);
  EXPECT_EQ(reader.at(1.02, 0.0), 100) << "the wall should remain in the grid";
  fuseFrames(3, 6.0);
  ASSERT_TRUE(waitUntil([&] { return reader.at(7.02, 0.0) == 100; }));
  expectUpToDate(reader);

  const auto update =
      firstMessage<map_msgs::OccupancyGridUpdate>("/mapping/occupancy_grid_updates");
  EXPECT_EQ(update.width, reader.grid().info.width);
  EXPECT_EQ(update.data, reader.grid().data);
}

TEST_F(SpaceTest, GridFollowsClearedAndLoadedMaps) {
  const GridReader reader(nh_);
  fuseFrames(3);
  ASSERT_TRUE(waitUntil([&] { return reader.at(1.02, 0.0) == 100 && reader.at(0.5, 0.0) == 0; }));
  expectUpToDate(reader);
  const nav_msgs::OccupancyGrid before = reader.grid();
  ASSERT_TRUE(saveMapAs("wall.dtsdf").success);

  dtsdf_mapping::ClearRegion clear;
  clear.request.box.pose.position.x = 1.0;
  clear.request.box.pose.position.y = 0.2;
  clear.request.box.size.x = clear.request.box.size.y = clear.request.box.size.z = 0.3;
  ASSERT_TRUE(callService("/mapping/clear_region", clear));
  ASSERT_TRUE(clear.response.success) << clear.response.message;
  EXPECT_TRUE(waitUntil([&] { return reader.at(1.02, 0.2) == -1; }));
  EXPECT_EQ(reader.at(0.95, 0.2), -1) << "the cleared region should be unknown";
  EXPECT_EQ(reader.at(0.5, 0.2), 0);
  EXPECT_EQ(reader.at(1.02, -0.2), 100);
  expectUpToDate(reader);

  clearMap();
  EXPECT_TRUE(waitUntil([&] { return reader.count(-1) == reader.grid().data.size(); }));
  expectUpToDate(reader);

  ASSERT_TRUE(loadMapFrom("wall.dtsdf").success);
  EXPECT_TRUE(waitUntil([&] { return reader.at(1.02, 0.2) == 100; }));
  for (size_t i = 0; i < before.data.size(); ++i) {
    EXPECT_EQ(reader.grid().data[i] == 100, before.data[i] == 100) << i;
  }
  expectUpToDate(reader);
}

/// The free-space grid may use an eighth of the memory budget of 256 MB.
TEST_F(SpaceTest, StatusReportsItsBudget) {
  std::map<std::string, uint64_t> limits;
  ASSERT_TRUE(waitUntil([&] {
    for (const auto& part : status_.status().memory) limits[part.name] = part.limit_bytes;
    return limits.count("space") == 1;
  }));
  EXPECT_EQ(limits["map"], uint64_t{224} << 20);
  EXPECT_EQ(status_.status().max_map_bytes, uint64_t{224} << 20);
}

TEST_F(SpaceTest, SlicesContainDistances) {
  fuseFrames(3);
  sensor_msgs::PointCloud2 cloud;
  const ros::Subscriber subscriber = nh_.subscribe<sensor_msgs::PointCloud2>(
      "/mapping/distance_slice", 1,
      [&](const sensor_msgs::PointCloud2::ConstPtr& message) { cloud = *message; });
  ASSERT_TRUE(waitUntil([&] { return cloud.width > 0; }));
  EXPECT_EQ(cloud.header.frame_id, "map");
  size_t ahead = 0;
  sensor_msgs::PointCloud2ConstIterator<float> point(cloud, "x"), distance(cloud, "intensity");
  for (; point != point.end(); ++point, ++distance) {
    EXPECT_FLOAT_EQ(point[2], 0.02f);
    if (std::abs(point[1]) > 0.1f || point[0] > 1.0f || point[0] < 0.1f) continue;
    EXPECT_NEAR(*distance, 1.02f - point[0], 1.0 * kCell_m);
    ++ahead;
  }
  EXPECT_GT(ahead, 30u);
}

}  // namespace
}  // namespace dtsdf
