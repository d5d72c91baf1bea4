#include "ros/output/status_report.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

using dtsdf_mapping::MapStatus;

bool says(const MapStatus& status, const std::string& text) {
  return status.message.find(text) != std::string::npos;
}

StatusInput makeInput() {
  StatusInput input;
  input.image_topic = "/camera/depth/image_rect";
  input.info_topic = "/camera/depth/camera_info";
  return input;
}

TEST(StatusReport, SaysStepByStepWhatIsMissing) {
  StatusInput input = makeInput();
  MapStatus status = makeStatus(input);
  EXPECT_EQ(status.level, MapStatus::WARN);
  EXPECT_TRUE(says(status, "no depth image received on '/camera/depth/image_rect'"));
  EXPECT_TRUE(says(status, "no publisher"));
  input.depth_topics = {"/a/depth", "/b/depth"};
  EXPECT_TRUE(says(makeStatus(input), "depth is published on '/a/depth' and '/b/depth'"));
  input.image_publishers = 1;
  EXPECT_TRUE(says(makeStatus(input), "sent nothing yet"));

  input.frames.images = 5;
  EXPECT_TRUE(says(makeStatus(input), "no camera_info on '/camera/depth/camera_info'"));
  input.frames.camera_infos = 5;
  EXPECT_EQ(makeStatus(input).level, MapStatus::OK);
  input.waiting_for = "no transform from 'camera' to 'map'";
  EXPECT_TRUE(says(makeStatus(input), "no transform from 'camera' to 'map'"));
  input.waiting_for.clear();
  input.frames.dropped[static_cast<size_t>(DropReason::kBadEncoding)] = 1;
  input.frames.last_drop = "encoding 'bgr8'";
  EXPECT_TRUE(says(makeStatus(input), "encoding 'bgr8'"));

  input.frames.fused = 1;
  EXPECT_TRUE(says(makeStatus(input), "nobody listens"));
  input.mesh_listeners = 1;
  EXPECT_TRUE(says(makeStatus(input), "no triangles yet"));
  input.output.triangles = 1;
  EXPECT_EQ(makeStatus(input).message, "mapping");
}

TEST(StatusReport, WarnsWhenMappingGoesWrong) {
  StatusInput input = makeInput();
  input.frames.fused = 10;
  input.output.triangles = 1;
  input.newly_dropped = 3;
  input.newly_fused = 2;
  input.frames.last_drop = "the reason";
  EXPECT_TRUE(says(makeStatus(input), "the reason"));
  input.map.stats.refused_blocks = 7;
  EXPECT_TRUE(says(makeStatus(input), "map/max_memory_mb"));
  input.paused = true;
  EXPECT_EQ(makeStatus(input).message, "paused");
  input.map.failure = "out of memory";
  EXPECT_EQ(makeStatus(input).level, MapStatus::ERROR);
  EXPECT_TRUE(says(makeStatus(input), "out of memory"));
}

TEST(StatusReport, ListsTheReasonsThatOccurred) {
  StatusInput input = makeInput();
  input.frames.dropped[static_cast<size_t>(DropReason::kQueueFull)] = 2;
  input.frames.dropped[static_cast<size_t>(DropReason::kPoseJump)] = 3;
  const MapStatus status = makeStatus(input);
  ASSERT_EQ(status.dropped.size(), 2u);
  EXPECT_EQ(status.dropped[0].reason, "queue_full");
  EXPECT_EQ(status.dropped[1].count, 3u);
  EXPECT_EQ(status.frames_dropped, 5u);
}

}  // namespace
}  // namespace dtsdf
