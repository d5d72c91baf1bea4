/// Tests the demo without RViz. The simulated camera circles in its room, and the mesh must match
/// the room.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>

#include <cmath>

#include "ros/support/mesh_of_map.h"
#include "ros/support/mesh_watcher.h"
#include "ros/support/output_folder.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"
#include "simulation/scene.h"

namespace dtsdf {
namespace {

constexpr uint64_t kFramesOfLap = 60;
constexpr double kVoxel_m = 0.05;

/// Checks that the wall in the middle is yellow on one side and green on the other, although it is
/// only 30 mm thick, which is less than a voxel.
void expectWallPainted(const MeshWatcher& mesh) {
  size_t sides[2] = {0, 0}, wrong = 0;
  for (const auto& [id, marker] : mesh.shown()) {
    ASSERT_EQ(marker.colors.size(), marker.points.size());
    for (size_t i = 0; i < marker.points.size(); ++i) {
      const geometry_msgs::Point& p = marker.points[i];
      if (std::abs(p.x) > 0.7 || std::abs(p.y) > 0.03 || p.z < 0.2 || p.z > 1.5) continue;
      const bool is_yellow = marker.colors[i].r > marker.colors[i].g;
      ++sides[p.y > 0.0 ? 1 : 0];
      wrong += is_yellow != (p.y > 0.0);
    }
  }
  EXPECT_GT(sides[0], 100u);
  EXPECT_GT(sides[1], 100u);
  EXPECT_LT(wrong, (sides[0] + sides[1]) / 50);
}

TEST(SimulatedCamera, MeshMatchesTheRoom) {
  ros::NodeHandle nh;
  const MeshWatcher mesh(nh);
  const StatusWatcher status(nh);
  bool diagnosed = false;
  const ros::Subscriber diagnostics = nh.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const diagnostic_msgs::DiagnosticArray::ConstPtr& message) {
        for (const auto& entry : message->status) {
          diagnosed |= entry.name.find("mapping") != std::string::npos && !entry.values.empty();
        }
      });
  ASSERT_TRUE(waitUntil(
      [&] { return status.status().frames_fused + status.status().frames_dropped >= kFramesOfLap; },
      60.0))
      << status.status().message;
  EXPECT_GE(status.status().frames_fused, kFramesOfLap / 2) << status.status().message;
  EXPECT_TRUE(waitUntil([&] { return status.status().message == "mapping"; }));
  pauseMapping(true);
  const auto saved = saveMapAs("room.dtsdf");
  ASSERT_TRUE(saved.success) << saved.message;
  const MeshOfMap expected = meshOfMap(saved.path);
  ASSERT_GT(expected.triangles, 0u);
  ASSERT_TRUE(waitUntil([&] { return status.status().triangles == expected.triangles; }));
  ASSERT_TRUE(waitUntil([&] { return mesh.triangles() == expected.shown; }));
  EXPECT_TRUE(waitUntil([&] { return diagnosed; }));
  EXPECT_GT(status.status().integrate_ms, 0.0f);

  const Scene room = makeRoomScene();
  size_t points = 0, far_off = 0;
  for (const auto& [id, marker] : mesh.shown()) {
    for (const geometry_msgs::Point& p : marker.points) {
      ++points;
      if (room.distanceToSurface({p.x, p.y, p.z}) > kVoxel_m) ++far_off;
    }
  }
  EXPECT_GT(points, 10000u);
  EXPECT_LT(far_off, points / 50);
  expectWallPainted(mesh);
}

TEST(SimulatedCamera, MeshIsSaved) {
  const auto saved = saveMesh("room.ply");
  EXPECT_TRUE(saved.success) << saved.message;
  EXPECT_GT(saved.triangles, 1000u);
  removeOutputFolder();
}

}  // namespace
}  // namespace dtsdf
