/// Tests the services save_map and load_map, including calls that must be refused.
#include <dtsdf_mapping/ClearRegion.h>
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <thread>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "ros/support/mesh_watcher.h"
#include "ros/support/wait.h"
#include "ros/support/wall_camera.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

class MapsTest : public WallCamera {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(WallCamera::SetUp());
    clearMap();
    fuseFrames(3);
  }

  std::string in(const std::string& name) const { return folder_ + "/" + name; }

  /// Writes a map of the same wall with the given voxel size and map frame.
  void writeOtherMap(const std::string& name, float voxel_size_m, const std::string& map_frame) {
    MapperParams params;
    params.backend = Backend::kCpu;
    params.map.voxel_size_m = voxel_size_m;
    const auto mapper = makeMapper(params);
    const std::vector<uint16_t> depth_mm(64 * 48, 1000);
    DepthFrame frame;
    frame.data = depth_mm.data();
    frame.row_bytes = 64 * sizeof(uint16_t);
    frame.width = 64;
    frame.height = 48;
    frame.encoding = DepthEncoding::kUint16;
    frame.unit_m = 0.001f;
    frame.intrinsics = {50.0f, 50.0f, 31.5f, 23.5f};
    for (int i = 0; i < 3; ++i) ASSERT_EQ(mapper->integrate(frame).status, FrameStatus::kFused);
    MapContents contents = mapper->contents();
    contents.map_frame = map_frame;
    saveMap(contents, in(name));
  }

  /// Checks that load_map refuses a file and leaves the map unchanged.
  void expectRefused(const std::string& name, const std::string& word) {
    const std::string before = readBytes(saveMapAs("before.dtsdf").path);
    ASSERT_FALSE(before.empty());
    const auto response = loadMapFrom(name);
    EXPECT_FALSE(response.success) << name;
    EXPECT_NE(response.message.find(word), std::string::npos) << response.message;
    EXPECT_TRUE(response.path.empty());
    EXPECT_EQ(response.blocks, 0u);
    EXPECT_TRUE(readBytes(saveMapAs("after.dtsdf").path) == before) << "changed by " << name;
  }

  const std::string folder_ = outputFolder();
};

TEST_F(MapsTest, AreRestoredAsTheyWereSaved) {
  const MeshWatcher mesh(nh_);
  const auto saved = saveMapAs("maps/wall.dtsdf");
  ASSERT_TRUE(saved.success) << saved.message;
  EXPECT_EQ(saved.path, fs::weakly_canonical(in("maps/wall.dtsdf")).string());
  EXPECT_GT(saved.blocks, 0u);
  const MapInfo info = readMapInfo(saved.path);
  EXPECT_EQ(info.size.blocks, saved.blocks);
  EXPECT_EQ(info.map_frame, "map");
  EXPECT_EQ(info.frames, 3u);
  EXPECT_GT(info.stamp_s, 1e9);
  const auto before = saveMesh("before.ply");
  ASSERT_TRUE(before.success) << before.message;

  clearMap();
  ASSERT_TRUE(waitUntil([&] { return mesh.shown().empty(); }));
  const auto loaded = loadMapFrom("maps/wall.dtsdf");
  ASSERT_TRUE(loaded.success) << loaded.message;
  EXPECT_EQ(loaded.path, saved.path);
  EXPECT_EQ(loaded.blocks, saved.blocks);
  EXPECT_TRUE(waitUntil([&] { return mesh.triangles() == before.triangles; }));
  EXPECT_TRUE(waitUntil([&] { return status_.status().loaded_map == saved.path; }));
  EXPECT_EQ(status_.status().blocks, saved.blocks);
  EXPECT_FLOAT_EQ(status_.status().voxel_size_m, 0.05f);
  const auto after = saveMesh("after.ply");
  EXPECT_TRUE(readBytes(after.path) == readBytes(before.path));
  EXPECT_TRUE(readBytes(saveMapAs("again.dtsdf").path) == readBytes(saved.path));
  clearMap();
  EXPECT_TRUE(waitUntil([&] { return status_.status().loaded_map.empty(); }));
}

TEST_F(MapsTest, ReplaceTheCurrentMap) {
  const auto saved = saveMapAs("wall.dtsdf");
  const std::string mesh = readBytes(saveMesh("before.ply").path);
  fuseFrames(5);
  ASSERT_TRUE(loadMapFrom("wall.dtsdf").success);
  EXPECT_TRUE(readBytes(saveMapAs("again.dtsdf").path) == readBytes(saved.path));
  EXPECT_TRUE(readBytes(saveMesh("after.ply").path) == mesh);
}

/// The journal must restore a map that was loaded, partly cleared and extended.
TEST_F(MapsTest, AreRestoredByTheirJournal) {
  ASSERT_TRUE(saveMapAs("wall.dtsdf").success);
  fuseFrames(2);
  ASSERT_TRUE(loadMapFrom("wall.dtsdf").success);
  fuseFrames(1);
  dtsdf_mapping::ClearRegion clear;
  clear.request.sphere.center.z = 1.0;
  clear.request.sphere.radius = 0.3;
  ASSERT_TRUE(callService("/mapping/clear_region", clear));
  ASSERT_GT(clear.response.voxels, 0u) << clear.response.message;
  fuseFrames(1);
  const std::string map = readBytes(saveMapAs("now.dtsdf").path);
  ASSERT_FALSE(map.empty());
  const std::string again = in("again.dtsdf"), command = std::string(DTSDF_RECONSTRUCT) + " " +
                                                         newestJournalIn(in("journals")) +
                                                         " --save-map " + again + " > " +
                                                         in("reconstruct.log") + " 2>&1";
  EXPECT_TRUE(waitUntil([&] {  // the last records may not be in the file yet
    return std::system(command.c_str()) == 0 && readBytes(again) == map;
  })) << readBytes(in("reconstruct.log"));
}

/// If the camera is far from its last position when a map is loaded, at most one frame is dropped.
TEST_F(MapsTest, LetTheCameraStartAnywhere) {
  ASSERT_TRUE(saveMapAs("wall.dtsdf").success);
  ASSERT_TRUE(loadMapFrom("wall.dtsdf").success);
  for (const double x_m : {30.0, 0.0}) {
    const uint64_t fused = status_.status().frames_fused;
    for (int i = 0; i < 2; ++i) {
      const ros::Time stamp = camera_.nextStamp();
      camera_.sendTransform(stamp, {x_m, 0.0, 0.0});
      camera_.send(camera_.image(stamp), camera_.info(stamp));
    }
    EXPECT_TRUE(status_.waitForFused(fused + 1)) << status_.status().message;
  }
}

TEST_F(MapsTest, AreSavedAndLoadedWhilePaused) {
  pauseMapping(true);
  const auto saved = saveMapAs("wall.dtsdf");
  EXPECT_TRUE(saved.success) << saved.message;
  clearMap();
  const auto loaded = loadMapFrom("wall.dtsdf");
  EXPECT_TRUE(loaded.success) << loaded.message;
  pauseMapping(false);
  EXPECT_EQ(loaded.blocks, saved.blocks);
}

TEST_F(MapsTest, GiveAnEmptyMapTheirSettings) {
  writeOtherMap("coarse.dtsdf", 0.08f, "map");
  clearMap();
  const auto loaded = loadMapFrom("coarse.dtsdf");
  ASSERT_TRUE(loaded.success) << loaded.message;
  ASSERT_TRUE(waitUntil([&] { return std::abs(status_.status().voxel_size_m - 0.08f) < 1e-6f; }));
  const auto mesh = saveMesh("coarse.ply");
  ASSERT_TRUE(mesh.success) << mesh.message;
  const MeshWatcher shown(nh_);
  ASSERT_TRUE(waitUntil([&] { return shown.triangles() == mesh.triangles; }));
  for (const auto& [id, marker] : shown.shown()) {
    for (const geometry_msgs::Point& point : marker.points) EXPECT_NEAR(point.z, 1.0, 0.02);
  }
  fuseFrames(2);
  // A map is saved with its own settings. After clear_map, load_map accepts other settings.
  ASSERT_TRUE(saveMapAs("coarse_too.dtsdf").success);
  EXPECT_NEAR(std::get<double>(readMapInfo(in("coarse_too.dtsdf")).settings["map/voxel_size_m"]),
              0.08, 1e-9);
  writeOtherMap("fine.dtsdf", 0.05f, "map");
  clearMap();
  EXPECT_TRUE(loadMapFrom("fine.dtsdf").success);
}

TEST_F(MapsTest, AreRefusedIfTheyDoNotFit) {
  writeOtherMap("coarse.dtsdf", 0.08f, "map");
  expectRefused("coarse.dtsdf", "map/voxel_size_m");
  writeOtherMap("elsewhere.dtsdf", 0.05f, "odom");
  expectRefused("elsewhere.dtsdf", "'odom'");
  // The name of the map frame comes from a file, so it must not be able to move the cursor or forge
  // log lines.
  const std::string evil = "map\n[INFO] all is well\x1b[2J\u009b2J\u202e" + std::string(5000, 'x');
  writeOtherMap("evil.dtsdf", 0.05f, evil);
  expectRefused("evil.dtsdf", "'map\\x0a[INFO] all is well\\x1b[2J\\xc2\\x9b2J\\xe2\\x80\\xae");
  EXPECT_LT(loadMapFrom("evil.dtsdf").message.size(), 500u);
  writeOtherMap("unnamed.dtsdf", 0.05f, "");
  EXPECT_TRUE(loadMapFrom("unnamed.dtsdf").success);
}

TEST_F(MapsTest, AreRefusedIfDamaged) {
  const std::string good = readBytes(saveMapAs("good.dtsdf").path);
  expectRefused("missing.dtsdf", "cannot read");
  writeBytes(in("cut.dtsdf"), good.substr(0, good.size() / 2));
  expectRefused("cut.dtsdf", "damaged");
  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 4);
  writeBytes(in("flipped.dtsdf"), flipped);
  expectRefused("flipped.dtsdf", "damaged");
  writeBytes(in("text.dtsdf"), "no map at all, whatever its name says");
  expectRefused("text.dtsdf", "is not a map file");
}

TEST_F(MapsTest, AreSavedUnderTheOutputDirectory) {
  expectRefused("/nowhere/map.dtsdf", "cannot read");  // maps may be loaded from any folder
  const auto saved = saveMapAs("../map.dtsdf");
  EXPECT_FALSE(saved.success);
  EXPECT_NE(saved.message.find("output_directory"), std::string::npos) << saved.message;
  EXPECT_TRUE(saved.path.empty());
  EXPECT_FALSE(fs::exists(in("../map.dtsdf")));
  EXPECT_NE(saveMesh("../mesh.ply").message.find("output_directory"), std::string::npos);
  EXPECT_NE(saveMapAs("map.ply").message.find("use .dtsdf"), std::string::npos);
  EXPECT_NE(saveMesh("map.dtsdf").message.find("use .ply"), std::string::npos);
}

TEST_F(MapsTest, ConcurrentCallsAreServedOneByOne) {
  const std::string good = readBytes(saveMapAs("good.dtsdf").path);
  std::vector<std::thread> callers;
  std::atomic<int> failures{0};
  for (int i = 0; i < 12; ++i) {
    callers.emplace_back([&, i] {
      const std::string name = "many" + std::to_string(i / 3);
      const bool success = i % 3 == 0   ? saveMapAs(name + ".dtsdf").success
                           : i % 3 == 1 ? loadMapFrom("good.dtsdf").success
                                        : saveMesh(name + ".ply").success;
      if (!success) ++failures;
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(failures, 0);
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(readBytes(in("many" + std::to_string(i) + ".dtsdf")) == good);
  }
  fuseFrames(1);
}

/// Starts a separate node with a map from outside its output directory.
TEST_F(MapsTest, CanBeLoadedAtStart) {
  const auto saved = saveMapAs("start.dtsdf");
  const TemporaryFolder elsewhere;
  fs::copy_file(saved.path, elsewhere / "start.dtsdf");
  ros::param::set("/second/backend", "cpu");
  ros::param::set("/second/map/load_file", elsewhere / "start.dtsdf");
  const pid_t node = fork();
  if (node == 0) {
    execl(DTSDF_MAPPING_NODE, DTSDF_MAPPING_NODE, "__name:=second", nullptr);
    _exit(127);
  }
  dtsdf_mapping::MapStatus status;
  const ros::Subscriber subscriber = nh_.subscribe<dtsdf_mapping::MapStatus>(
      "/second/status", 1,
      [&](const dtsdf_mapping::MapStatus::ConstPtr& message) { status = *message; });
  EXPECT_TRUE(waitUntil([&] { return status.blocks == saved.blocks; }));
  EXPECT_EQ(status.loaded_map, elsewhere / "start.dtsdf");
  EXPECT_FLOAT_EQ(status.voxel_size_m, 0.05f) << "the node should use the voxel size of the file";
  kill(node, SIGINT);
  int result = 0;
  EXPECT_EQ(waitpid(node, &result, 0), node);
  ros::param::del("/second");
}

}  // namespace
}  // namespace dtsdf
