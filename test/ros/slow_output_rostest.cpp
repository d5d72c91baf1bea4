/// Tests that fusion continues while a large mesh is published and saved.
#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>

#include <chrono>
#include <cmath>
#include <future>

#include "ros/support/mesh_watcher.h"
#include "ros/support/wall_camera.h"

namespace dtsdf {
namespace {

class SlowOutput : public WallCamera {};

TEST_F(SlowOutput, DoesNotStopFusing) {
  const MeshWatcher mesh(nh_);
  size_t clouds = 0;
  const ros::Subscriber points = nh_.subscribe<sensor_msgs::PointCloud2>(
      "/mapping/surface_points", 1, [&](const sensor_msgs::PointCloud2::ConstPtr&) { ++clouds; });
  for (int i = 0; i < kPlaces; ++i) fuseNextPlace();

  // Each frame is sent only after the previous frame was fused, so all counted frames were fused
  // before the save ended.
  int fused_while_saving = 0;
  for (int saves = 0; saves < 10 && fused_while_saving < 5; ++saves) {
    auto saving = std::async(std::launch::async, [] { return saveMesh("large.obj"); });
    fused_while_saving = -1;  // the frame in progress at the end of the save does not count
    while (saving.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      fuseNextPlace();
      ++fused_while_saving;
    }
    const auto saved = saving.get();
    EXPECT_TRUE(saved.success) << saved.message;
    EXPECT_GT(saved.triangles, 100000u);
  }
  EXPECT_GE(fused_while_saving, 5);
  EXPECT_EQ(status_.status().frames_dropped, 0u);

  // Once publishing has caught up, the whole mesh has been published, but for gaps between chunks.
  const auto saved = saveMesh("large.obj");
  const auto isComplete = [&] {
    return std::abs(static_cast<double>(mesh.triangles()) / saved.triangles - 1.0) < 0.02;
  };
  EXPECT_TRUE(waitUntil(isComplete));
  EXPECT_TRUE(waitUntil([&] { return clouds > 0; }));
}

}  // namespace
}  // namespace dtsdf
