/// Test fixture with a FakeCamera, which is 1 m in front of a wall.
#pragma once

#include <gtest/gtest.h>

#include "ros/support/fake_camera.h"
#include "ros/support/output_folder.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"

namespace dtsdf {

class WallCamera : public testing::Test {
 protected:
  static constexpr int kPlaces = 64;

  void SetUp() override {
    ASSERT_TRUE(camera_.connect());
    ASSERT_TRUE(waitUntil([&] { return status_.received(); }));
  }
  static void TearDownTestSuite() { removeOutputFolder(); }

  /// Sends a frame from a position in the map frame, and waits until it is fused.
  void fuseFrame(const Eigen::Vector3d& t_W = {0.0, 0.0, 0.0}) {
    const uint64_t fused = status_.status().frames_fused;
    const ros::Time stamp = camera_.nextStamp();
    camera_.sendTransform(stamp, t_W);
    camera_.send(camera_.image(stamp), camera_.info(stamp));
    ASSERT_TRUE(status_.waitForFused(fused + 1)) << status_.status().message;
  }

  void fuseFrames(int count) {
    for (int i = 0; i < count; ++i) ASSERT_NO_FATAL_FAILURE(fuseFrame());
  }

  /// Fuses a frame from the next of kPlaces positions in a grid parallel to the wall.
  void fuseNextPlace() {
    const int place = static_cast<int>(status_.status().frames_fused) % kPlaces;
    fuseFrame({0.5 * (place % 8), 0.5 * (place / 8), 0.0});
  }

  ros::NodeHandle nh_;
  FakeCamera camera_{nh_};
  StatusWatcher status_{nh_};
};

}  // namespace dtsdf
