#include "ros/output/status_report.h"

#include <gtest/gtest.h>

#include "ros/output/status_history.h"

namespace dtsdf {
namespace {

using dtsdf_mapping::MapStatus;

bool says(const MapStatus& status, const std::string& text) {
  return status.message.find(text) != std::string::npos;
}

StatusInput makeInput() {
  StatusInput input;
  input.cameras.resize(1);
  input.cameras[0].depth.image_topic = "/camera/depth/image_rect";
  input.cameras[0].depth.info_topic = "/camera/depth/camera_info";
  return input;
}

TEST(StatusReport, NamesTheTransportThatIsPublished) {
  StatusInput input = makeInput();
  const std::string topic = input.cameras[0].depth.image_topic;
  input.topics.depth = input.topics.only_compressed = {topic};
  EXPECT_TRUE(says(makeStatus(input),
                   "it is published as sensor_msgs/CompressedImage; set "
                   "image_transport:=compressedDepth"));
  input.topics.only_compressed.clear();
  EXPECT_FALSE(says(makeStatus(input), "image_transport"));
  input.cameras[0].depth.image_topic = topic + "/compressedDepth";
  EXPECT_TRUE(
      says(makeStatus(input), "it is published as sensor_msgs/Image; set image_transport:=raw"));
}

TEST(ColourHint, IsGivenOnceWhereColourStaysAway) {
  StatusInput input = makeInput();
  CameraReport& camera = input.cameras[0];
  camera.colour.emplace();
  ColourHint hint;
  SteadyTime now;
  EXPECT_EQ(hint.update(input.cameras, now), nullptr);
  now += 2 * ColourHint::kPatience;
  EXPECT_EQ(hint.update(input.cameras, now), nullptr) << "nothing was fused";
  camera.depth.frames.fused = 1;
  EXPECT_EQ(hint.update(input.cameras, now), nullptr) << "it may start later than depth";
  now += ColourHint::kPatience;
  EXPECT_EQ(hint.update(input.cameras, now), &camera);
  now += 2 * ColourHint::kPatience;
  EXPECT_EQ(hint.update(input.cameras, now), nullptr) << "once";
}

TEST(StatusReport, SaysStepByStepWhatIsMissing) {
  StatusInput input = makeInput();
  StreamReport& depth = input.cameras[0].depth;
  MapStatus status = makeStatus(input);
  EXPECT_EQ(status.level, MapStatus::WARN);
  EXPECT_TRUE(says(status, "no depth image received on '/camera/depth/image_rect'"));
  EXPECT_TRUE(says(status, "no publisher"));
  input.topics.depth = {"/a/depth", "/b/depth"};
  EXPECT_TRUE(says(makeStatus(input), "depth is published on '/a/depth' and '/b/depth'"));
  depth.image_publishers = 1;
  EXPECT_TRUE(says(makeStatus(input), "sent nothing yet"));

  depth.frames.images = 5;
  EXPECT_TRUE(lacksInput(input.cameras[0]));
  EXPECT_TRUE(says(makeStatus(input), "no camera_info on '/camera/depth/camera_info'"));
  EXPECT_FALSE(says(makeStatus(input), "set camera_info:="));
  input.topics.camera_info = {"/a/camera_info"};
  EXPECT_TRUE(
      says(makeStatus(input), "; camera_info is published on '/a/camera_info'; set camera_info:="));
  depth.frames.camera_infos = 5;
  EXPECT_FALSE(lacksInput(input.cameras[0]));
  EXPECT_EQ(makeStatus(input).level, MapStatus::OK);
  depth.waiting_for = "no transform from 'camera' to 'map'";
  EXPECT_TRUE(says(makeStatus(input), "no transform from 'camera' to 'map'"));
  depth.waiting_for.clear();
  depth.frames.dropped[static_cast<size_t>(DropReason::kBadEncoding)] = 1;
  depth.frames.last_drop = "encoding 'bgr8'";
  EXPECT_TRUE(says(makeStatus(input), "encoding 'bgr8'"));

  depth.frames.fused = 1;
  EXPECT_TRUE(says(makeStatus(input), "nobody subscribes"));
  TopicStatus topic;
  input.output.topics = {topic};
  EXPECT_TRUE(says(makeStatus(input), "nobody subscribes"));
  input.output.topics[0].listeners = 1;  // of points, it may be
  EXPECT_TRUE(says(makeStatus(input), "no triangles yet"));
  input.output.topics.clear();
  input.output.space_topics = {topic};
  EXPECT_TRUE(says(makeStatus(input), "no triangles yet"));
  input.output.triangles = 1;
  EXPECT_EQ(makeStatus(input).message, "mapping");
  input.correction.obstacle = "the map is too large";
  EXPECT_EQ(makeStatus(input).message, "mapping; poses cannot be corrected: the map is too large");
}

TEST(StatusReport, SaysThatTheCameraIsLostAndHowImagesFit) {
  StatusInput input = makeInput();
  FrameCounts& frames = input.cameras[0].depth.frames;
  frames.images = frames.fused = 10;
  input.output.triangles = 1;
  EXPECT_EQ(makeStatus(input).cameras[0].pose.outcome, "") << "poses are TF's";

  input.poses.cameras.resize(1);
  CameraPoseReport& pose = input.poses.cameras[0];
  pose.last = Alignment();
  pose.last->status = AlignmentStatus::kMisfit;
  pose.last->inlier_share = 0.25;
  pose.last->shift_m = 0.5;
  pose.stamp = ros::Time(12.0);
  pose.free_shifts = {Eigen::Vector3d::UnitY()};
  pose.outcomes[static_cast<size_t>(AlignmentStatus::kMisfit)] = 4;
  MapStatus status = makeStatus(input);
  EXPECT_EQ(status.message, "mapping");
  EXPECT_EQ(status.cameras[0].pose.outcome, toString(AlignmentStatus::kMisfit));
  EXPECT_EQ(status.cameras[0].pose.stamp, pose.stamp);
  EXPECT_EQ(status.cameras[0].pose.inlier_share, 0.25f);
  EXPECT_EQ(status.cameras[0].pose.correction_m, 0.5f);
  ASSERT_EQ(status.cameras[0].pose.free_shifts.size(), 1u);
  EXPECT_EQ(status.cameras[0].pose.free_shifts[0].y, 1.0);
  ASSERT_EQ(status.cameras[0].pose.outcomes.size(), 1u);
  EXPECT_EQ(status.cameras[0].pose.outcomes[0].count, 4u);

  input.poses.problem = "'camera' has another parent";
  EXPECT_EQ(makeStatus(input).message, input.poses.problem);
  pose.lost_since_s = 11.5;
  status = makeStatus(input);
  EXPECT_EQ(status.level, MapStatus::WARN);
  EXPECT_TRUE(says(status, "the camera is lost")) << status.message;
  EXPECT_EQ(status.cameras[0].pose.lost_since, ros::Time(11.5));
  input.stale_s = 1.0;
  input.ran_s = 10.0;
  frames.image_age_s = frames.fused_age_s = 2.0;
  EXPECT_TRUE(says(makeStatus(input), "no depth image is received")) << "more than it is lost";
}

TEST(StatusReport, WarnsWhenMappingGoesWrong) {
  StatusInput input = makeInput();
  StreamReport& depth = input.cameras[0].depth;
  depth.frames.fused = 10;
  input.output.triangles = 1;
  const MapStatus before = makeStatus(input);
  EXPECT_EQ(before.message, "mapping");
  depth.frames.fused += 2;
  depth.frames.dropped[static_cast<size_t>(DropReason::kPoseJump)] = 3;
  depth.frames.last_drop = "the reason";
  EXPECT_TRUE(says(makeStatus(input, before), "most frames are dropped: the reason"));
  depth.warning = "not an optical frame";
  EXPECT_TRUE(says(makeStatus(input, makeStatus(input)), "not an optical frame"));
  depth.warning.clear();
  input.map.stats.refused_blocks = 7;
  EXPECT_TRUE(says(makeStatus(input, makeStatus(input)),
                   "raise map/max_memory_mb or set map/keep_radius_m"));
  input.map.stats.pages.failures = 1;
  input.map.stats.pages.problem = "no space";
  EXPECT_TRUE(says(makeStatus(input, makeStatus(input)), "the disk of map/page_folder: no space"));
  input.map.stats.refused_blocks = 0;
  input.map.stats.pages.lost = 4;
  EXPECT_TRUE(says(makeStatus(input, makeStatus(input)),
                   "4 blocks or sectors of cells could not be read back"));
  input.map.stats.pages = PageStats();
  input.output.paged_meshes.lost = 8;
  input.output.paged_meshes.problem = "check the disk";
  EXPECT_TRUE(says(makeStatus(input, makeStatus(input)),
                   "the meshes of 8 blocks could not be read back and are not shown: check the"));
  input.output.paged_meshes = PagedMeshes::Stats();
  input.output.paged_meshes.failures = 1;
  input.output.paged_meshes.problem = "the disk is full";
  input.output.mesh_bytes = input.output.max_mesh_bytes = 1000;
  EXPECT_FALSE(says(makeStatus(input, makeStatus(input)), "the disk is full")) << "there is room";
  input.output.mesh_bytes = 1001;
  EXPECT_TRUE(says(makeStatus(input, makeStatus(input)), "stay in memory: the disk is full"));
  input.output.paged_meshes = PagedMeshes::Stats();
  input.map.stats.refused_cubes = 3;
  EXPECT_TRUE(says(makeStatus(input, makeStatus(input)), "memory for free space"));
  EXPECT_TRUE(
      says(makeStatus(input, makeStatus(input)), "raise map/max_memory_mb or space/cell_voxels"));
  EXPECT_EQ(makeStatus(input).refused_cubes, 3u);
  input.paused = true;
  EXPECT_EQ(makeStatus(input).message, "paused");
  input.map.failure = "out of memory";
  EXPECT_EQ(makeStatus(input).level, MapStatus::ERROR);
  EXPECT_TRUE(says(makeStatus(input), "out of memory"));
}

dtsdf_mapping::MemoryPart partOf(const MapStatus& status, const std::string& name) {
  for (const auto& part : status.memory) {
    if (part.name == name) return part;
  }
  dtsdf_mapping::MemoryPart none;
  none.place = "nowhere";
  return none;
}

TEST(StatusReport, ListsWhatLiesOnDisk) {
  StatusInput input = makeInput();
  input.map.stats.pages.written = 9;
  input.map.stats.pages.bytes = 1234;
  input.map.stats.pages.index_bytes = 56;
  input.map.stats.pages.blocks = 3;
  input.map.stats.pages.read = 6;
  input.map.stats.pages.waits = 2;
  input.map.stats.pages.wait_ms = 1500.0;
  input.map.stats.map_bytes_peak = 77;
  const MapStatus status = makeStatus(input);
  EXPECT_EQ(status.map_bytes_peak, 77u);
  EXPECT_EQ(status.paged_blocks, 3u);
  EXPECT_EQ(status.paged_bytes, 1234u);
  EXPECT_EQ(status.pages_written, 9u);
  EXPECT_EQ(status.pages_read, 6u);
  EXPECT_EQ(status.page_waits, 2u);
  EXPECT_EQ(status.page_wait_s, 1.5f);
  EXPECT_EQ(partOf(status, "pages").place, "disk");
  EXPECT_EQ(partOf(status, "pages").bytes, 1234u);
  EXPECT_EQ(partOf(status, "page_index").place, "host");
  EXPECT_EQ(partOf(status, "page_index").bytes, 56u);

  PagedMeshes::Stats& meshes = input.output.paged_meshes;
  meshes.bytes = 1000;
  meshes.index_bytes = 4;
  meshes.failures = 5;
  EXPECT_EQ(partOf(makeStatus(input), "pages").bytes, 2234u);
  EXPECT_EQ(partOf(makeStatus(input), "page_index").bytes, 60u);
  EXPECT_EQ(makeStatus(input).page_failures, 5u);
}

TEST(StatusReport, ReportsDropsThoughMostFramesAreFused) {
  StatusInput input = makeInput();
  FrameCounts& frames = input.cameras[0].depth.frames;
  input.output.triangles = 1;
  RecentDrops recent;
  SteadyTime now;
  const auto statusAfter = [&](uint64_t fused, DropReason reason, uint64_t dropped) {
    input.recent_drops = recent.update(input.cameras, now);
    const MapStatus before = makeStatus(input);
    now += std::chrono::seconds(10);
    frames.images += fused + dropped;
    frames.fused += fused;
    frames.dropped[static_cast<size_t>(reason)] += dropped;
    frames.camera_infos = frames.images;
    input.recent_drops = recent.update(input.cameras, now);
    return makeStatus(input, before);
  };
  EXPECT_EQ(statusAfter(300, DropReason::kBeforeTransforms, 40).message, "mapping");
  EXPECT_EQ(statusAfter(300, DropReason::kQueueFull, 3).message, "mapping");
  MapStatus status = statusAfter(237, DropReason::kQueueFull, 63);
  EXPECT_EQ(status.level, MapStatus::WARN);
  EXPECT_TRUE(says(status,
                   "% of the depth images were dropped lately, most as queue_full: use "
                   "larger voxels"))
      << status.message;
  frames.last_drop = "frame dropped (queue_full)";
  status = statusAfter(20, DropReason::kQueueFull, 80);
  EXPECT_TRUE(says(status,
                   "most frames are dropped: frame dropped (queue_full); use larger "
                   "voxels"))
      << status.message;
  EXPECT_EQ(statusAfter(300, DropReason::kPaused, 1000).level, MapStatus::WARN) << "still lately";
  statusAfter(300, DropReason::kPaused, 0);
  statusAfter(300, DropReason::kPaused, 0);
  EXPECT_EQ(statusAfter(300, DropReason::kPaused, 0).message, "mapping") << "long ago";
}

TEST(TroubleLog, LogsEachTroubleThatLastsOnce) {
  TroubleLog log;
  SteadyTime now;
  int logged = 0;
  const auto pass = [&](int seconds, bool is_well, const std::string& message) {
    for (int i = 0; i < seconds; ++i) {
      now += std::chrono::seconds(1);
      logged += log.update(is_well, message, now) ? 1 : 0;
    }
    return logged;
  };
  EXPECT_EQ(pass(4, false, "no depth image received on '/a'"), 0);
  EXPECT_EQ(pass(1000, false, "no depth image received on '/a'"), 1);
  EXPECT_EQ(pass(20, false, "no frame fused yet: no transform"), 2) << "another trouble";
  EXPECT_EQ(pass(20, true, "mapping"), 2);
  EXPECT_EQ(pass(20, false, "no frame fused yet: no transform"), 2) << "too soon";
  EXPECT_EQ(pass(60, true, "mapping"), 2);
  EXPECT_EQ(pass(20, false, "no frame fused yet: no transform"), 3);
  for (int i = 0; i < 20; ++i) {
    pass(1, false, "no depth image comes; the last came " + std::to_string(i));
  }
  EXPECT_EQ(logged, 4) << "names and numbers are not another trouble";
}

TEST(StatusReport, SaysWhatHasFallenSilentAndForHowLong) {
  StatusInput input = makeInput();
  StreamReport& depth = input.cameras[0].depth;
  depth.image_publishers = 1;
  depth.frames.images = depth.frames.camera_infos = depth.frames.fused = 10;
  depth.frames.image_age_s = depth.frames.fused_age_s = 0.1;
  input.output.triangles = 1;
  input.stale_s = 5.0;
  input.ran_s = 1000.0;
  EXPECT_EQ(makeStatus(input).message, "mapping");

  depth.frames.image_age_s = depth.frames.fused_age_s = 7.0;
  input.transforms.age_s = 0.2;
  MapStatus status = makeStatus(input);
  EXPECT_EQ(status.level, MapStatus::WARN);
  EXPECT_TRUE(says(status,
                   "no depth image is received on '/camera/depth/image_rect'; last image "
                   "7 s ago, last transform 0 s ago, last fused frame 7 s ago"))
      << status.message;
  depth.image_publishers = 0;
  depth.frames.image_age_s = depth.frames.fused_age_s = 16.0;
  status = makeStatus(input);
  EXPECT_EQ(status.level, MapStatus::ERROR);
  EXPECT_TRUE(says(status, "its publisher is gone")) << status.message;

  depth.frames.image_age_s = 0.1;
  depth.frames.last_drop = "dropped (no_transform)";
  status = makeStatus(input);
  EXPECT_EQ(status.level, MapStatus::ERROR);
  EXPECT_TRUE(says(status, "no frame is fused: dropped (no_transform)")) << status.message;
  depth.frames.fused_age_s = 0.0;
  EXPECT_EQ(makeStatus(input).message, "mapping") << "back by itself";
}

/// What was refused is counted on until the map is cleared; what is wrong now has to show all the
/// same.
TEST(StatusReport, AFullMapHidesNothingThatIsWrongNow) {
  for (const bool is_space : {false, true}) {
    StatusInput input = makeInput();
    (is_space ? input.map.stats.refused_cubes : input.map.stats.refused_blocks) = 7;
    EXPECT_TRUE(says(makeStatus(input), "no depth image received"));
    StreamReport& depth = input.cameras[0].depth;
    depth.frames.images = depth.frames.camera_infos = depth.frames.fused = 10;
    depth.frames.image_age_s = depth.frames.fused_age_s = 0.1;
    input.stale_s = 5.0;
    input.ran_s = 1000.0;
    const MapStatus full = makeStatus(input);
    EXPECT_EQ(full.level, MapStatus::WARN);
    EXPECT_TRUE(says(full, "map/max_memory_mb")) << full.message;

    input.transforms.refused = 1;
    EXPECT_TRUE(says(makeStatus(input, full), "transforms are refused"));
    depth.frames.image_age_s = depth.frames.fused_age_s = 16.0;
    const MapStatus silent = makeStatus(input, makeStatus(input));
    EXPECT_EQ(silent.level, MapStatus::ERROR);
    EXPECT_TRUE(says(silent, "no depth image is received")) << silent.message;
  }
}

TEST(StatusReport, SilenceInAPauseIsNoFault) {
  StatusInput input = makeInput();
  StreamReport& depth = input.cameras[0].depth;
  depth.frames.images = depth.frames.camera_infos = depth.frames.fused = 10;
  depth.frames.image_age_s = depth.frames.fused_age_s = 600.0;
  input.output.triangles = 1;
  input.stale_s = 5.0;
  input.ran_s = 4.0;
  EXPECT_EQ(makeStatus(input).message, "mapping") << "it was over only 4 s ago";
  input.ran_s = 0.0;
  input.time_stands = true;
  EXPECT_EQ(makeStatus(input).message,
            "mapping; no new images: /clock is not advancing (the bag ended or is paused)");
  EXPECT_EQ(makeStatus(input).level, MapStatus::OK);
  input.ran_s = 600.0;
  input.paused = true;
  EXPECT_EQ(makeStatus(input).level, MapStatus::OK);
  input.paused = input.time_stands = false;
  input.stale_s = 0.0;
  EXPECT_EQ(makeStatus(input).message, "mapping") << "as the setting asks for";
}

TEST(StatusReport, NamesTransformsThatAreRefused) {
  StatusInput input = makeInput();
  input.cameras[0].depth.frames.fused = 10;
  input.output.triangles = 1;
  input.transforms.refused = 2;
  input.transforms.refused_by = {{"frame 'camera' of /slam: ahead of time", 2}};
  input.transforms.last_refusal = "frame 'camera' of /slam: 60 s ahead";
  const MapStatus status = makeStatus(input);
  EXPECT_EQ(status.level, MapStatus::WARN);
  EXPECT_TRUE(says(status, "transforms are refused: frame 'camera' of /slam: 60 s ahead"));
  EXPECT_EQ(status.transforms_refused, 2u);
  ASSERT_EQ(status.refused_transforms.size(), 1u);
  EXPECT_EQ(status.refused_transforms[0].count, 2u);
  EXPECT_EQ(makeStatus(input, status).message, "mapping") << "no new ones";
}

TEST(StatusReport, AMasterThatHasForgottenTheNodeIsAnError) {
  StatusInput input = makeInput();
  input.master = "the master was restarted";
  EXPECT_EQ(makeStatus(input).level, MapStatus::ERROR);
  EXPECT_TRUE(says(makeStatus(input), "the master was restarted"));
}

TEST(StatusReport, SaysWhichCameraItIs) {
  StatusInput input = makeInput();
  input.cameras.push_back(input.cameras[0]);
  input.cameras[0].name = "front";
  input.cameras[1].name = "rear";
  input.cameras[1].depth.image_topic = "/rear/depth/image_rect";
  EXPECT_TRUE(says(makeStatus(input), "front: no depth image received on '/camera"));
  input.cameras[0].depth.frames.fused = 1;
  input.output.triangles = 1;
  const MapStatus one = makeStatus(input);
  EXPECT_EQ(one.level, MapStatus::WARN);
  EXPECT_TRUE(says(one, "rear: no depth image received on '/rear/depth/image_rect'"));
  input.cameras[1].depth.frames.fused = 1;
  EXPECT_EQ(makeStatus(input, one).message, "mapping");
  input.cameras[1].depth.frames.dropped[static_cast<size_t>(DropReason::kOutOfOrder)] = 2;
  EXPECT_TRUE(says(makeStatus(input, one), "rear: most frames are dropped"));
}

TopicStatus topic(const std::string& name, uint64_t waiting_bytes) {
  TopicStatus status;
  status.topic = name;
  status.waiting_bytes = waiting_bytes;
  return status;
}

TEST(StatusReport, TellsEachPartOfMemoryWithItsPlaceAndLimit) {
  StatusInput input = makeInput();
  input.cameras[0].depth.waiting_bytes = 200;
  input.map.stats.map_bytes = 1000;
  input.map.stats.colour_bytes = 100;
  input.map.memory.spare = 11;
  input.map.memory.indices = 22;
  input.map.memory.scratch = 33;
  input.map.memory.meshes = 44;
  input.map.memory.staging = 55;
  input.output.mesh_bytes = 300;
  input.output.topics = {topic("/mapping/mesh", 10), topic("/mapping/mesh_blocks", 60)};
  input.map.stats.max_map_bytes = 5000;
  input.max_image_bytes = 400;
  input.max_queue_bytes = 600;
  input.process_bytes = 7000;
  struct Expected {
    const char* name;
    uint64_t bytes, limit_bytes;
  };
  for (const bool on_gpu : {false, true}) {
    input.map.memory.on_gpu = on_gpu;
    const MapStatus status = makeStatus(input);
    EXPECT_EQ(status.memory.size(), on_gpu ? 11u : 9u);
    const std::string map_place = on_gpu ? "gpu" : "host";
    for (const Expected& e : {Expected{"map", 900, 5000},
                              {"colour", 100, 5000},
                              {"spare", 11, 0},
                              {"indices", 22, 0},
                              {"scratch", 33, 0}}) {
      const auto part = partOf(status, e.name);
      EXPECT_EQ(part.place, map_place) << e.name;
      EXPECT_EQ(part.bytes, e.bytes) << e.name;
      EXPECT_EQ(part.limit_bytes, e.limit_bytes) << e.name;
    }
    for (const Expected& e : {Expected{"mesh", 300, 0},
                              {"images", 200, 400},
                              {"queues", 70, 600},
                              {"process", 7000, 0}}) {
      const auto part = partOf(status, e.name);
      EXPECT_EQ(part.place, "host") << e.name;
      EXPECT_EQ(part.bytes, e.bytes) << e.name;
      EXPECT_EQ(part.limit_bytes, e.limit_bytes) << e.name;
    }
    EXPECT_EQ(partOf(status, "meshes").place, on_gpu ? "gpu" : "nowhere");
    EXPECT_EQ(partOf(status, "staging").bytes, on_gpu ? 55u : 0u);
    input.map.memory.space = 70;
    input.output.space_bytes = 7;
    EXPECT_EQ(partOf(makeStatus(input), "space").bytes, 77u);
    EXPECT_EQ(partOf(makeStatus(input), "space").place, "host");
    EXPECT_EQ(status.max_map_bytes, 5000u);
    EXPECT_EQ(partOf(status, "space_queues").place, "nowhere");
    input.output.space_topics = {topic("/mapping/occupancy_grid", 800)};
    EXPECT_EQ(partOf(makeStatus(input), "queues").bytes, 70u) << "the limit is the mesh's";
    EXPECT_EQ(partOf(makeStatus(input), "space_queues").bytes, 800u);
    EXPECT_EQ(partOf(makeStatus(input), "space_queues").limit_bytes, 0u);
    EXPECT_EQ(makeStatus(input).topics.back().topic, "/mapping/occupancy_grid");
    input.output.space_topics.clear();
    input.map.memory.space = 0;
  }
}

TEST(StatusReport, CountsEachCameraAndAllTogether) {
  StatusInput input = makeInput();
  input.cameras.push_back(input.cameras[0]);
  for (int i = 0; i < 2; ++i) {
    CameraReport& camera = input.cameras[i];
    camera.name = i == 0 ? "front" : "rear";
    camera.depth.frames.images = 10 + i;
    camera.depth.frames.fused = 5 + i;
    camera.depth.frames.dropped[static_cast<size_t>(DropReason::kQueueFull)] = 1 + i;
    camera.depth.frames.last_fused_stamp = ros::Time(7.0 - i);
    camera.depth.waiting = 2;
  }
  input.cameras[1].depth.frames.image_age_s = 0.25;
  input.output.topics = {topic("/mapping/mesh", 10), topic("/mapping/mesh_blocks", 60)};
  const MapStatus status = makeStatus(input);
  EXPECT_EQ(status.images_received, 21u);
  EXPECT_EQ(status.frames_fused, 11u);
  EXPECT_EQ(status.frames_dropped, 3u);
  ASSERT_EQ(status.dropped.size(), 1u);
  EXPECT_EQ(status.dropped[0].reason, "queue_full");
  EXPECT_EQ(status.dropped[0].count, 3u);
  EXPECT_EQ(status.frames_waiting, 4u);
  EXPECT_EQ(status.last_fused_stamp, ros::Time(7.0));
  ASSERT_EQ(status.cameras.size(), 2u);
  EXPECT_EQ(status.cameras[1].name, "rear");
  ASSERT_EQ(status.cameras[1].streams.size(), 1u);
  const dtsdf_mapping::StreamStatus& rear = status.cameras[1].streams[0];
  EXPECT_EQ(rear.kind, "depth");
  EXPECT_EQ(rear.received, 11u);
  EXPECT_EQ(rear.fused, 6u);
  EXPECT_EQ(rear.dropped[0].count, 2u);
  EXPECT_EQ(rear.last_fused_stamp, ros::Time(6.0));
  EXPECT_EQ(rear.received_age_s, 0.25f);
  EXPECT_EQ(status.cameras[0].streams[0].received_age_s, -1.0f) << "none has come";
  EXPECT_TRUE(status.topics == input.output.topics);
}

TEST(StatusReport, TellsOfColourThatCannotBePainted) {
  StatusInput input = makeInput();
  input.cameras[0].depth.frames.fused = 1;
  input.output.triangles = 1;
  EXPECT_EQ(makeStatus(input).message, "mapping");
  input.cameras[0].colour.emplace();
  StreamReport& colour = *input.cameras[0].colour;
  colour.image_topic = "/camera/color/image_rect";
  colour.info_topic = "/camera/color/camera_info";
  EXPECT_EQ(makeStatus(input).message, "mapping") << "nobody has asked for it";
  input.cameras[0].is_colour_needed = true;
  EXPECT_TRUE(says(makeStatus(input), "no colour image received on '/camera/color/image_rect'"));
  colour.frames.images = 3;
  EXPECT_TRUE(says(makeStatus(input), "no camera_info on '/camera/color/camera_info'"));
  colour.frames.camera_infos = 3;
  colour.frames.dropped[static_cast<size_t>(DropReason::kNoTransform)] = 3;
  colour.frames.last_drop = "the reason";
  EXPECT_TRUE(says(makeStatus(input), "no colour image painted yet: the reason"));
  EXPECT_EQ(makeStatus(input).frames_dropped, 0u) << "those are depth's";
  colour.frames.fused = 1;
  EXPECT_EQ(makeStatus(input).message, "mapping");
  const dtsdf_mapping::StreamStatus stream = makeStatus(input).cameras[0].streams.at(1);
  EXPECT_EQ(stream.kind, "color");
  EXPECT_EQ(stream.fused, 1u);
  EXPECT_EQ(stream.dropped.at(0).count, 3u);
}

}  // namespace
}  // namespace dtsdf
