// Tests the status reported by all parts of the node except the input.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "ros/common/status_fields.h"
#include "ros/node/output.h"
#include "ros/steps/poses.h"
#include "ros/support/map_host.h"

namespace dtsdf {
namespace {

dtsdf_mapping::MemoryPart partOf(const MapStatus& status, const std::string& name) {
  for (const auto& part : status.memory) {
    if (part.name == name) return part;
  }
  dtsdf_mapping::MemoryPart none;
  none.place = "nowhere";
  return none;
}

/// Status of a live map whose mapper reports these statistics.
MapStatus statusOf(const MapStats& counts, const MapperMemory& held = {}) {
  auto mapper = std::make_unique<FakeMapper>();
  mapper->counts = counts;
  mapper->held = held;
  MapHost host(std::move(mapper));
  PosedFrame frame;
  frame.stamp = ros::Time(1.0);
  frame.image = DepthFrame();
  host.push(0, std::move(frame));
  host.work();
  return host.status();
}

void expect(const MapStatus& status, uint8_t code, const std::string& message) {
  EXPECT_EQ(status.level, MapStatus::WARN) << status.message;
  EXPECT_EQ(status.code, code) << status.message;
  EXPECT_EQ(status.message, message);
}

TEST(Status, ReportsWhatExceedsTheBudget) {
  MapStats counts;
  EXPECT_EQ(statusOf(counts).code, MapStatus::MAPPING);
  counts.refused_cubes = 3;
  expect(statusOf(counts), MapStatus::SPACE_FULL,
         "3 free-space cubes stayed unknown because the memory for free-space cells (an eighth of "
         "map/max_memory_mb) is full; surfaces are still mapped; raise map/max_memory_mb or "
         "space/cell_voxels");
  EXPECT_EQ(statusOf(counts).refused_cubes, 3u);
  counts.refused_blocks = 7;
  expect(statusOf(counts), MapStatus::MAP_FULL,
         "7 blocks were refused because the map is full; it stays usable; raise map/max_memory_mb "
         "or set map/keep_radius_m or map/page_folder");
  counts.refused_cubes = 0;
  counts.pages.failures = 1;
  counts.pages.problem = "no space";
  expect(statusOf(counts), MapStatus::DISK_FULL,
         "7 blocks were refused because map/page_folder is full or fails: no space");
  counts.pages.lost = 4;
  expect(statusOf(counts), MapStatus::PAGES_LOST,
         "4 blocks or free-space sectors could not be read back: no space");
}

/// Blocks refused by a full map are reported until it is cleared, but must not hide a current
/// problem.
TEST(Status, AFullMapDoesNotHideCurrentProblems) {
  MapStats counts;
  counts.refused_blocks = 7;
  MapStatus status = statusOf(counts);
  report(status, MapStatus::WARN, MapStatus::NO_COLOUR, "colour");
  EXPECT_EQ(status.code, MapStatus::NO_COLOUR);
  report(status, MapStatus::ERROR, MapStatus::SILENT, "silent");
  EXPECT_EQ(status.code, MapStatus::SILENT);
}

TEST(Status, ReportsTheDataOnDisk) {
  MapStats counts;
  counts.pages.bytes = 1234;
  counts.pages.index_bytes = 56;
  counts.pages.blocks = 3;
  counts.pages.waits = 2;
  counts.pages.wait_ms = 1500.0;
  MapStatus status = statusOf(counts);
  EXPECT_EQ(status.paged_blocks, 3u);
  EXPECT_EQ(status.paged_bytes, 1234u);
  EXPECT_EQ(status.page_waits, 2u);
  EXPECT_EQ(status.page_wait_s, 1.5f);
  PagedMeshes::Stats meshes;
  meshes.bytes = 1000;
  meshes.index_bytes = 4;
  meshes.failures = 5;
  fillMeshes(meshes, 10, 20, status);
  EXPECT_EQ(partOf(status, "pages").place, "disk");
  EXPECT_EQ(partOf(status, "pages").bytes, 2234u);
  EXPECT_EQ(partOf(status, "page_index").place, "host");
  EXPECT_EQ(partOf(status, "page_index").bytes, 60u);
  EXPECT_EQ(status.page_failures, 5u);
}

TEST(Status, ReportsMeshesLostOrKeptInMemory) {
  const auto statusOf = [](const PagedMeshes::Stats& pages, size_t bytes) {
    MapStatus status;
    fillMeshes(pages, bytes, 1000, status);
    return status;
  };
  PagedMeshes::Stats pages;
  pages.failures = 1;
  pages.problem = "the disk is full";
  EXPECT_EQ(statusOf(pages, 1000).code, MapStatus::MAPPING)
      << "a write failure should not be reported while there is room";
  expect(statusOf(pages, 1001), MapStatus::DISK_FULL,
         "meshes cannot be moved to disk: the disk is full");
  pages.lost = 8;
  expect(statusOf(pages, 1001), MapStatus::PAGES_LOST,
         "8 blocks of the mesh could not be read back: the disk is full");
}

TEST(Status, ListsMemoryWithPlacesAndLimits) {
  MapStats counts;
  counts.map_bytes = 1000;
  counts.colour_bytes = 100;
  MapperMemory held;
  held.spare = 11;
  held.indices = 22;
  held.scratch = 33;
  held.meshes = 44;
  held.staging = 55;
  held.space = 70;
  struct Expected {
    const char* name;
    uint64_t bytes, limit_bytes;
  };
  for (const bool on_gpu : {false, true}) {
    held.on_gpu = on_gpu;
    MapStatus status = statusOf(counts, held);
    for (const Expected& e : {Expected{"map", 900, FakeMapper::kBudgetBytes},
                              {"colour", 100, FakeMapper::kBudgetBytes},
                              {"spare", 11, 0},
                              {"indices", 22, 0},
                              {"scratch", 33, 0}}) {
      const auto part = partOf(status, e.name);
      EXPECT_EQ(part.place, on_gpu ? "gpu" : "host") << e.name;
      EXPECT_EQ(part.bytes, e.bytes) << e.name;
      EXPECT_EQ(part.limit_bytes, e.limit_bytes) << e.name;
    }
    EXPECT_EQ(partOf(status, "meshes").place, on_gpu ? "gpu" : "nowhere");
    EXPECT_EQ(partOf(status, "staging").bytes, on_gpu ? 55u : 0u);
    EXPECT_EQ(partOf(status, "space").place, "host");
    addMemory(status, "space", kHost, 7);
    EXPECT_EQ(partOf(status, "space").bytes, 77u) << "parts with the same name should be added up";
    fillMeshes({}, 300, 600, status);
    EXPECT_EQ(partOf(status, "mesh").bytes, 300u);
    EXPECT_EQ(partOf(status, "mesh").limit_bytes, 600u);
  }
}

TEST(Status, ReportsALostCameraAndItsLastFit) {
  NodeParams params;
  params.poses.mode = PoseMode::kTrack;
  auto mapper = std::make_unique<FakeMapper>();
  mapper->aligns = [](const DepthFrame& frame) {
    Alignment alignment;
    alignment.T_W_C = frame.T_W_C;
    alignment.status = AlignmentStatus::kMisfit;
    alignment.inlier_share = 0.25;
    alignment.shift_m = 0.5;
    return alignment;
  };
  MapHost host(std::move(mapper), params);
  PosesStep poses(host.host);
  MapStatus status;
  status.cameras.resize(1);
  poses.fill(status);
  EXPECT_EQ(status.code, MapStatus::MAPPING);
  EXPECT_EQ(status.cameras[0].pose.outcome, "");
  const auto take = [&](double stamp_s) {
    PosedFrame frame;
    frame.stamp = ros::Time(stamp_s);
    frame.frame_id = "camera";
    frame.image = DepthFrame();
    if (poses.expect(frame) || poses.place(frame)) return;
    host.map.mapper().integrate(std::get<DepthFrame>(frame.image));
    poses.fused(frame, {});
  };
  for (int i = 0; i < 30; ++i) take(1.0 + 0.1 * i);
  poses.fill(status);
  expect(status, MapStatus::CAMERA_LOST,
         "the camera is lost, and nothing is fused: move it back slowly to where it was, call "
         "set_pose, or start over with clear_map");
  const dtsdf_mapping::PoseStatus& pose = status.cameras[0].pose;
  EXPECT_EQ(pose.outcome, toString(AlignmentStatus::kMisfit));
  EXPECT_NEAR(pose.stamp.toSec(), 3.9, 1e-6);
  EXPECT_EQ(pose.inlier_share, 0.25f);
  EXPECT_EQ(pose.correction_m, 0.5f);
  EXPECT_FALSE(pose.lost_since.isZero());
}

}  // namespace
}  // namespace dtsdf
