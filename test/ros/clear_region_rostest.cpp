/// Tests the service clear_region and map/keep_radius_m: what they remove, refused requests, and
/// the mesh afterwards.
#include <dtsdf_mapping/ClearRegion.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "ros/support/mesh_watcher.h"
#include "ros/support/wait.h"
#include "ros/support/wall_camera.h"

namespace dtsdf {
namespace {

using dtsdf_mapping::ClearRegion;

ClearRegion::Response call(const ClearRegion::Request& request) {
  ClearRegion clear;
  clear.request = request;
  EXPECT_TRUE(callService("/mapping/clear_region", clear));
  return clear.response;
}

ClearRegion::Request sphereAt(double x, double y, double z, double radius_m,
                              const std::string& frame_id = "") {
  ClearRegion::Request request;
  request.frame_id = frame_id;
  request.sphere.center.x = x;
  request.sphere.center.y = y;
  request.sphere.center.z = z;
  request.sphere.radius = radius_m;
  return request;
}

ClearRegion::Request boxOf(double x, double y, double z) {
  ClearRegion::Request request;
  request.box.size.x = x;
  request.box.size.y = y;
  request.box.size.z = z;
  return request;
}

class ClearRegionTest : public WallCamera {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(WallCamera::SetUp());
    clearMap();
    fuseFrames(2);
  }

  /// Fuses frames of the wall, 1 m in front of the camera. Camera and base are at `x`.
  void fuseFrames(int count, double x = 0.0) {
    for (int i = 0; i < count; ++i) {
      const uint64_t fused = status_.status().frames_fused;
      const ros::Time stamp = camera_.nextStamp();
      camera_.sendTransform(stamp, {x, 0.0, 0.0}, "base");
      camera_.sendTransform(stamp, {x, 0.0, 0.0});
      camera_.send(camera_.image(stamp), camera_.info(stamp));
      ASSERT_TRUE(status_.waitForFused(fused + 1)) << status_.status().message;
    }
  }

  bool waitForBlocks(uint64_t count) {
    return waitUntil([&] { return status_.status().blocks == count; });
  }
};

TEST_F(ClearRegionTest, ClearsABoxAndUpdatesTheMarkers) {
  const MeshWatcher mesh(nh_);
  ASSERT_TRUE(waitUntil([&] { return mesh.triangles() > 0; }));
  const auto reach = [&] {
    double least = 1e9;
    for (const auto& [id, marker] : mesh.shown()) {
      for (const auto& point : marker.points) least = std::min(least, point.x);
    }
    return least;
  };
  EXPECT_LT(reach(), -0.2);
  ClearRegion::Request request = boxOf(10.0, 10.0, 10.0);
  request.box.pose.position.x = -5.0;  // everything with x < 0
  const auto cleared = call(request);
  EXPECT_TRUE(cleared.success) << cleared.message;
  EXPECT_GT(cleared.voxels, 100u);
  EXPECT_GT(cleared.blocks, 0u);
  EXPECT_NE(cleared.message.find(std::to_string(cleared.voxels)), std::string::npos);
  EXPECT_TRUE(waitUntil([&] { return mesh.triangles() > 0 && reach() > -0.06; })) << reach();
}

TEST_F(ClearRegionTest, AcceptsAnyKnownFrame) {
  fuseFrames(1, 0.5);
  // The wall is 1 m in front of the camera and the base, which are at x = 0.5 now.
  const auto cleared = call(sphereAt(0.0, 0.0, 1.0, 0.2, "/base"));
  EXPECT_TRUE(cleared.success) << cleared.message;
  EXPECT_GT(cleared.voxels, 0u);
  EXPECT_EQ(call(sphereAt(0.5, 0.0, 1.0, 0.2, "map")).voxels, 0u);
  EXPECT_GT(call(sphereAt(0.0, 0.0, 1.0, 0.2)).voxels, 0u) << "this place should not be empty yet";
}

TEST_F(ClearRegionTest, ABoxMayBeRotated) {
  ClearRegion::Request request = boxOf(0.01, 10.0, 10.0);
  request.box.pose.orientation.z = std::sqrt(0.5);
  request.box.pose.orientation.w = std::sqrt(0.5);  // thin along y now
  const auto thin = call(request);
  EXPECT_TRUE(thin.success);
  EXPECT_GT(thin.voxels, 0u);
  request.box.pose.orientation.z = 0.0;
  request.box.pose.orientation.w = 1.0;
  EXPECT_GT(call(request).voxels, 0u) << "the first call should clear only the rotated box";
}

/// The map is cleared even while mapping is paused.
TEST_F(ClearRegionTest, ClearingAllSpaceEmptiesTheMap) {
  pauseMapping(true);
  EXPECT_GT(status_.status().blocks, 0u);
  EXPECT_TRUE(call(sphereAt(0.0, 0.0, 0.0, 1e6)).success);
  EXPECT_TRUE(waitForBlocks(0)) << status_.status().blocks;
  pauseMapping(false);
  EXPECT_EQ(status_.status().map_bytes, 0u);
  fuseFrames(1);
  EXPECT_TRUE(waitUntil([&] { return status_.status().blocks > 0; }));
}

TEST_F(ClearRegionTest, ConcurrentCallsAreServedOneByOne) {
  std::vector<std::thread> callers;
  std::vector<ClearRegion::Response> answers(8);
  for (size_t i = 0; i < answers.size(); ++i) {
    callers.emplace_back([&, i] { answers[i] = call(sphereAt(0.0, 0.0, 1.0, 0.3)); });
  }
  for (std::thread& caller : callers) caller.join();
  size_t emptied = 0;
  for (const auto& answer : answers) {
    EXPECT_TRUE(answer.success) << answer.message;
    emptied += answer.voxels > 0;
  }
  EXPECT_EQ(emptied, 1u) << "only the first call should find voxels";
}

TEST_F(ClearRegionTest, BadRequestsAreRefusedWithAReason) {
  const uint64_t blocks = status_.status().blocks;
  const auto expectRefused = [](const ClearRegion::Request& request, const std::string& word) {
    const auto response = call(request);
    EXPECT_FALSE(response.success) << word;
    EXPECT_NE(response.message.find(word), std::string::npos) << response.message;
    EXPECT_EQ(response.voxels + response.blocks, 0u);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expectRefused(ClearRegion::Request(), "neither");
  ClearRegion::Request both = boxOf(1.0, 1.0, 1.0);
  both.sphere.radius = 1.0;
  expectRefused(both, "one of them");
  expectRefused(sphereAt(0.0, 0.0, 0.0, 1.0, "nowhere"), "nowhere");
  expectRefused(sphereAt(0.0, 0.0, 0.0, -1.0), "radius");
  expectRefused(sphereAt(0.0, nan, 0.0, 1.0), "finite");
  expectRefused(sphereAt(0.0, 0.0, 0.0, nan), "finite");
  expectRefused(boxOf(1.0, -1.0, 1.0), "size");
  expectRefused(boxOf(1.0, 0.0, 1.0), "size");
  expectRefused(boxOf(1.0, nan, 1.0), "finite");
  ClearRegion::Request turned = boxOf(1.0, 1.0, 1.0);
  turned.box.pose.orientation.w = 3.0;
  expectRefused(turned, "quaternion");
  turned.box.pose.orientation.w = nan;
  expectRefused(turned, "quaternion");
  EXPECT_EQ(status_.status().blocks, blocks);
}

/// The base and the camera move by 8 m; map/keep_radius_m is 3 m.
TEST_F(ClearRegionTest, BlocksFarFromTheBaseAreDropped) {
  const uint64_t fused = status_.status().frames_fused, before = status_.status().blocks;
  EXPECT_EQ(status_.status().dropped_blocks, 0u);
  fuseFrames(2, 8.0);
  ASSERT_TRUE(waitUntil([&] { return status_.status().dropped_blocks >= before; }))
      << status_.status().dropped_blocks;
  EXPECT_EQ(status_.status().frames_fused, fused + 2);
  EXPECT_EQ(call(sphereAt(0.0, 0.0, 1.0, 1.5)).voxels, 0u);
  EXPECT_GT(call(sphereAt(8.0, 0.0, 1.0, 1.5)).voxels, 0u);
}

}  // namespace
}  // namespace dtsdf
