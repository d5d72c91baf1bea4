/// Compares a bag played in a loop under simulated time with the same bag read offline.
#include <gtest/gtest.h>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "io/bag_frames.h"
#include "ros/support/output_folder.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr uint64_t kFramesOfBag = 30;

BagOptions bagOptions() {
  BagOptions options;
  EXPECT_TRUE(ros::param::get("~bag", options.path));
  return options;
}

std::unique_ptr<FrameSource> openBag() { return openBagFrames(bagOptions()); }

std::string pathOf(const std::string& name) {
  const auto saved = saveMesh(name);
  EXPECT_TRUE(saved.success) << saved.message;
  return saved.path;
}

/// The mesh of the first `count` frames, fused offline, as a .ply file.
std::string offlinePlyAfter(uint64_t count) {
  const NodeParams params = nodeParams();
  const std::unique_ptr<Mapper> mapper = makeMapper(params.mapper);
  const std::unique_ptr<FrameSource> frames = openBag();
  for (uint64_t i = 0; i < count; ++i) mapper->integrate(frames->next()->depth);
  MeshStore store(params.mapper.map.voxel_size_m);
  store.apply(mapper->updateMesh());
  return plyOf(store.assemble(), params.mapper.mesh.colour);
}

TEST(Bag, IsReadOfflineWithoutLoss) {
  const std::unique_ptr<FrameSource> frames = openBag();
  EXPECT_EQ(frames->size(), kFramesOfBag);
  double last_stamp_s = 0.0;
  uint64_t count = 0;
  while (const auto frame = frames->next()) {
    EXPECT_GT(frame->stamp_s, last_stamp_s);
    last_stamp_s = frame->stamp_s;
    ++count;
  }
  EXPECT_EQ(count, kFramesOfBag);
  EXPECT_TRUE(frames->skipped().empty());
}

TEST(Bag, CameraAndPosesMayBeGivenSeparately) {
  const TemporaryFolder folder;
  writeBytes(folder / "slam.tum", "1000.1 7 0 0 0 0 0 1\n1000.3 9 0 0 0 0 0 1\n");
  BagOptions options = bagOptions();
  options.info_topic = "/not/recorded";
  options.intrinsics = Intrinsics{81, 82, 47, 36};
  options.poses_path = folder / "slam.tum";
  const std::unique_ptr<FrameSource> frames = openBagFrames(options);
  const auto frame = frames->next();
  ASSERT_TRUE(frame);
  EXPECT_NEAR(frame->stamp_s, 1000.1, 1e-6);
  EXPECT_EQ(frame->depth.T_W_C.translation().x(), 7.0);
  EXPECT_EQ(frame->depth.intrinsics.fy, 82.0f);
  EXPECT_TRUE(frames->next());
  EXPECT_FALSE(frames->next());
  EXPECT_EQ(frames->skipped().at("no pose within 20 ms"), kFramesOfBag - 2);
}

/// During the first loop, the node's map equals the offline map bit for bit.
TEST(Bag, NodeMeshEqualsTheOfflineMesh) {
  ros::NodeHandle nh;
  const StatusWatcher status(nh);
  ASSERT_TRUE(status.waitForFused(kFramesOfBag / 2)) << status.status().message;
  pauseMapping(true);
  ASSERT_TRUE(waitUntil([&] { return status.status().paused; }));
  const std::string path = pathOf("bag.ply");
  // The mesh and the next status include the frames that were in progress at the pause.
  const ros::Time seen = status.status().header.stamp;
  ASSERT_TRUE(waitUntil([&] { return status.status().header.stamp > seen; }));
  const uint64_t fused = status.status().frames_fused;
  ASSERT_LE(fused, kFramesOfBag) << "the pause came after the first loop; the machine is too slow";
  EXPECT_EQ(status.status().frames_dropped, status.dropped("paused"))
      << "a frame is missing: " << status.status().message;
  EXPECT_TRUE(readBytes(path) == offlinePlyAfter(fused)) << "after " << fused << " frames";
  removeOutputFolder();
  pauseMapping(false);
}

TEST(Bag, NextLoopIsFusedToo) {
  ros::NodeHandle nh;
  const StatusWatcher status(nh);
  ASSERT_TRUE(status.waitForFused(3 * kFramesOfBag)) << status.status().message;
  EXPECT_EQ(status.dropped("no_transform"), 0u);
  EXPECT_EQ(status.dropped("pose_jump"), 0u);
  EXPECT_EQ(status.dropped("queue_full"), 0u);
}

}  // namespace
}  // namespace dtsdf
