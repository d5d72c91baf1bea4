/// A large mesh that is shown and saved over and over again: the map goes on fusing meanwhile.
#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <string>

#include "ros/support/fake_camera.h"
#include "ros/support/mesh_watcher.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"

namespace dtsdf {
namespace {

class SlowOutput : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(camera_.connect());
    ASSERT_TRUE(waitUntil([&] { return status_.received(); }));
  }
  static void TearDownTestSuite() {
    std::string folder;
    if (ros::param::get("/mapping/output_directory", folder)) {
      std::filesystem::remove_all(folder);
    }
  }

  /// From place to place along a wall, in rows. Waits until the frame is fused.
  void fuseFrame() {
    const uint64_t fused = status_.status().frames_fused;
    const ros::Time stamp = camera_.nextStamp();
    const int place = static_cast<int>(fused) % kPlaces;
    camera_.sendTransform(stamp, {0.5 * (place % 8), 0.5 * (place / 8), 0.0});
    camera_.send(camera_.image(stamp), camera_.info(stamp));
    ASSERT_TRUE(status_.waitForFused(fused + 1)) << status_.status().message;
  }

  static constexpr int kPlaces = 64;
  ros::NodeHandle nh_;
  FakeCamera camera_{nh_};
  StatusWatcher status_{nh_};
};

dtsdf_mapping::SaveMesh::Response save() {
  dtsdf_mapping::SaveMesh call;
  call.request.file_name = "large.obj";
  EXPECT_TRUE(ros::service::call("/mapping/save_mesh", call));
  return call.response;
}

TEST_F(SlowOutput, DoesNotStopFusing) {
  const MeshWatcher mesh(nh_);
  size_t clouds = 0;
  const ros::Subscriber points = nh_.subscribe<sensor_msgs::PointCloud2>(
      "/mapping/surface_points", 1,
      [&](const sensor_msgs::PointCloud2::ConstPtr&) { ++clouds; });
  for (int i = 0; i < kPlaces; ++i) fuseFrame();

  // Each frame is sent once the one before is fused, so that each was fused before the save ended.
  int fused_while_saving = 0;
  for (int saves = 0; saves < 10 && fused_while_saving < 5; ++saves) {
    auto saving = std::async(std::launch::async, save);
    fused_while_saving = -1;  // the frame on its way when the save ended does not count
    while (saving.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      fuseFrame();
      ++fused_while_saving;
    }
    const auto saved = saving.get();
    EXPECT_TRUE(saved.success) << saved.message;
    EXPECT_GT(saved.triangles, 100000u);
  }
  EXPECT_GE(fused_while_saving, 5);
  EXPECT_EQ(status_.status().frames_dropped, 0u);

  // And when it has caught up, everything is there.
  const auto saved = save();
  EXPECT_TRUE(waitUntil([&] { return mesh.triangles() == saved.triangles; }));
  EXPECT_TRUE(waitUntil([&] { return clouds > 0; }));
}

}  // namespace
}  // namespace dtsdf
