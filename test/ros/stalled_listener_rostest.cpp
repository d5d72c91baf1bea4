/// Tests subscribers that stop reading a mesh topic. The node's memory must stay bounded, and other
/// subscribers must still be served. A mesh_blocks subscriber that resumes reading must get the
/// whole mesh.
#include <dtsdf_mapping/MeshBlocks.h>
#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <string>

#include "ros/support/blocks_watcher.h"
#include "ros/support/mesh_watcher.h"
#include "ros/support/raw_listener.h"
#include "ros/support/wall_camera.h"

namespace dtsdf {
namespace {

using dtsdf_mapping::MeshBlocks;
using sensor_msgs::PointCloud2;
using visualization_msgs::MarkerArray;
using Clock = std::chrono::steady_clock;

constexpr size_t kMegabyte = 1 << 20;
constexpr int kListeners = 20;

/// How long the subscribers stop reading, in seconds. Can be overridden by DTSDF_STALL_S.
double stallSeconds() {
  const char* text = std::getenv("DTSDF_STALL_S");
  return text == nullptr ? 15.0 : std::strtod(text, nullptr);
}

class StalledListener : public WallCamera {};

std::vector<std::array<double, 3>> cornersOf(const MeshWatcher& mesh) {
  std::vector<std::array<double, 3>> corners;
  for (const auto& [id, marker] : mesh.shown()) {
    for (const geometry_msgs::Point& p : marker.points) corners.push_back({p.x, p.y, p.z});
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

TEST_F(StalledListener, TakesLittleMemoryAndDelaysNobody) {
  const MeshWatcher mesh(nh_);
  const BlocksWatcher blocks(nh_);
  size_t clouds = 0;
  const ros::Subscriber points = nh_.subscribe<PointCloud2>(
      "/mapping/surface_points", 1, [&](const PointCloud2::ConstPtr&) { ++clouds; });
  for (int i = 0; i < 2 * kPlaces; ++i) fuseNextPlace();
  const int process = publishingProcess("/mapping/mesh");
  const size_t base = residentBytes(process);

  std::deque<RawListener> unread;
  for (int i = 0; i < kListeners; ++i) {
    unread.emplace_back("/mapping/mesh", ros::message_traits::datatype<MarkerArray>(),
                        ros::message_traits::md5sum<MarkerArray>());
    unread.emplace_back("/mapping/mesh_blocks", ros::message_traits::datatype<MeshBlocks>(),
                        ros::message_traits::md5sum<MeshBlocks>());
  }
  RawListener points_unread = listenRaw<PointCloud2>("/mapping/surface_points");
  const uint64_t markers_before = mesh.addedMarkers(), clouds_before = clouds;
  size_t most = base;
  const auto end = Clock::now() + std::chrono::duration<double>(stallSeconds());
  while (Clock::now() < end) {
    fuseNextPlace();
    most = std::max(most, residentBytes(process));
  }
  std::printf("resident: base %zu MB, most %zu MB\n", base / kMegabyte, most / kMegabyte);
  EXPECT_LT(most - base, 3 * 32 * kMegabyte + 60 * kMegabyte)
      << "at most 32 MB per topic should be added, plus the growth of the map";
  EXPECT_EQ(subscribersOf("/mapping/mesh"), 1u + kListeners);

  // Other subscribers received changes during the stall and the whole mesh in the end.
  EXPECT_GT(mesh.addedMarkers() - markers_before, 100u);
  EXPECT_GT(clouds, clouds_before);
  const auto saved = saveMesh("mesh.ply");
  ASSERT_GT(saved.triangles, 100000u);
  EXPECT_TRUE(waitUntil([&] {
    return mesh.triangles() == saved.triangles && blocks.state().triangles() == saved.triangles;
  }));
  EXPECT_TRUE(waitUntil([&] { return cornersOf(mesh) == blocks.state().corners(); }));

  // A stalled subscriber that resumes reading gets the whole mesh with the next refresh.
  BlocksState late;
  const auto deadline = Clock::now() + std::chrono::seconds(60);
  while (Clock::now() < deadline) {
    const auto message = unread[1].readMessage<MeshBlocks>(0.3);
    if (message) {
      late.take(*message);
      continue;
    }
    ros::spinOnce();
    if (late.corners() == blocks.state().corners())
      break;  // comparing after each message would be slow
  }
  EXPECT_TRUE(late.corners() == blocks.state().corners())
      << late.triangles() << " of " << saved.triangles << " triangles";
}

/// Needs the large map of the previous test, so that messages exceed the buffers of a connection.
TEST_F(StalledListener, DisconnectingMidMessageHarmsNobody) {
  const MeshWatcher mesh(nh_);
  ASSERT_TRUE(waitUntil([&] { return mesh.triangles() > 100000; }));
  const auto listeners = [&](const std::string& topic) {
    return subscribersOf("/mapping/" + topic);
  };
  // The subscribers of the previous test have closed their connections.
  ASSERT_TRUE(
      waitUntil([&] { return listeners("mesh") == 1 && listeners("surface_points") == 0; }));
  for (const char* topic : {"mesh", "surface_points"}) {
    SCOPED_TRACE(topic);
    const size_t before = listeners(topic);
    RawListener killed = std::string(topic) == "mesh"
                             ? listenRaw<MarkerArray>("/mapping/mesh")
                             : listenRaw<PointCloud2>("/mapping/surface_points");
    ASSERT_TRUE(waitUntil([&] { return listeners(topic) == before + 1; }));
    fuseNextPlace();
    ros::WallDuration(1.0).sleep();  // the node is now sending a message
    killed.disconnectAfter(1000);
    EXPECT_TRUE(waitUntil([&] { return listeners(topic) == before; }));
    fuseNextPlace();
  }
  // The subscriber that stayed connected receives the whole mesh.
  const auto saved = saveMesh("mesh.ply");
  EXPECT_TRUE(waitUntil([&] { return mesh.triangles() == saved.triangles; }));
}

}  // namespace
}  // namespace dtsdf
