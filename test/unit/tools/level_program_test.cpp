/// Tests map/level in reconstruct, on a recording with poses in the frame of its first camera.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "simulation/scene.h"
#include "support/run_program.h"
#include "support/scene_recording.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Poses along the lap, in the room's level frame.
std::vector<Eigen::Isometry3d> lapPoses(size_t count) {
  std::vector<Eigen::Isometry3d> poses;
  for (size_t i = 0; i < count; ++i) poses.push_back(roomCameraPose(0.1 * static_cast<double>(i)));
  return poses;
}

class LevelProgram : public testing::Test {
 protected:
  /// Writes a recording of the room, with poses in the frame of its first camera, and a second
  /// recording in which only a wall is visible.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const std::vector<Eigen::Isometry3d> poses = lapPoses(20);
    const Eigen::Isometry3d T_M_R = poses.front().inverse();
    writeSceneRecording(*folder_ / "first", makeRoomScene(), poses, 160, 120,
                        [&](size_t, const Eigen::Isometry3d& T_R_C) { return T_M_R * T_R_C; });
    Scene wall;
    wall.add(Plane{Vector3d(2.0, 0.0, 0.0), -Vector3d::UnitX()});
    const Eigen::Isometry3d ahead =
        lookAt(Vector3d::Zero(), Vector3d(1.0, 0.0, 0.0), Vector3d::UnitZ());
    writeSceneRecording(*folder_ / "wall", wall, std::vector<Eigen::Isometry3d>(12, ahead));
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string in(const std::string& name) { return *folder_ / name; }

  static Outcome run(const std::string& command) { return runIn(*folder_, command); }

  static Outcome reconstruct(const std::string& arguments) {
    return run(std::string(DTSDF_RECONSTRUCT) +
               " --backend cpu --set map/voxel_size_m=0.04 map/max_memory_mb=512 "
               "poses/mode=tf " +
               arguments);
  }

  /// Runs reconstruct. @return the saved map.
  static MapContents mapOf(const std::string& arguments, const std::string& name = "map.dtsdf") {
    const Outcome outcome = reconstruct(arguments + " --save-map " + in(name));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(contains(outcome.out, "levelled: ") == contains(arguments, "level=floor"))
        << outcome.out;
    return loadMap(in(name));
  }

  static TemporaryFolder* folder_;
};

TemporaryFolder* LevelProgram::folder_ = nullptr;

TEST_F(LevelProgram, PutsTheFloorAtZero) {
  const MapContents map = mapOf("--tum " + in("first") + " --set map/level=floor");
  ASSERT_TRUE(map.T_W_M);
  // The pose of the room in W, from the true pose of the first camera.
  const Eigen::Isometry3d T_W_R = *map.T_W_M * roomCameraPose(0.0).inverse();
  const Vector3d up_W = T_W_R.linear().col(2);
  EXPECT_LT(std::hypot(up_W.x(), up_W.y()), 0.1 * M_PI / 180.0);
  EXPECT_NEAR((T_W_R * Vector3d::Zero()).z(), 0.0, 0.002);
  // The map itself is level as well: its blocks extend from the floor to the ceiling.
  const double block_m = 0.04 * kBlockSide;
  int lowest = 1000, highest = -1000;
  for (const MapBlock& block : map.blocks) {
    lowest = std::min(lowest, block.key.z);
    highest = std::max(highest, block.key.z);
  }
  EXPECT_EQ(lowest, -1) << "the floor should be at a block border";
  EXPECT_EQ(highest, static_cast<int>(std::floor((2.6 + 0.16) / block_m)));
  const Outcome info = run(std::string(DTSDF_MAP_TOOL) + " info " + in("map.dtsdf"));
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_TRUE(contains(info.out, "\nlevelled ")) << info.out;
}

TEST_F(LevelProgram, IsOffByDefault) {
  const MapContents plain = mapOf("--tum " + in("first"), "plain.dtsdf");
  EXPECT_FALSE(plain.T_W_M);
  mapOf("--tum " + in("first") + " --set map/level=none", "none.dtsdf");
  EXPECT_TRUE(readBytes(in("plain.dtsdf")) == readBytes(in("none.dtsdf")));
  EXPECT_FALSE(contains(readBytes(in("plain.dtsdf")), "LEVL"));
}

/// A map built in two runs equals one built in a single run. The second run reads the levelling
/// transform from the map file.
TEST_F(LevelProgram, ContinuesInTheFrameOfTheMap) {
  const std::string input = "--tum " + in("first") + " ";
  mapOf(input + "--set map/level=floor", "whole.dtsdf");
  mapOf(input + "--set map/level=floor --frames 0:11", "half.dtsdf");
  // The second half alone would give a slightly different floor.
  const std::string second = input + "--frames 12: --save-map " + in("joined.dtsdf");
  for (const char* level : {"", " --set map/level=floor", " --set map/level=imu"}) {
    const Outcome outcome =
        reconstruct(second + " --load-map " + in("half.dtsdf") + std::string(level));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(readBytes(in("joined.dtsdf")) == readBytes(in("whole.dtsdf"))) << level;
  }

  const Outcome unlevelled =
      reconstruct(second + " --set map/level=none --load-map " + in("half.dtsdf"));
  EXPECT_EQ(unlevelled.exit_code, 1);
}

TEST_F(LevelProgram, FailsIfUpCannotBeFound) {
  const std::string input = "--tum " + in("wall") + " --mesh " + in("mesh.ply");
  const Outcome floor = reconstruct(input + " --set map/level=floor");
  EXPECT_EQ(floor.exit_code, 1);
  EXPECT_TRUE(contains(floor.err, "--frames FIRST:")) << floor.err;
  EXPECT_FALSE(std::filesystem::exists(in("mesh.ply")))
      << "no frames should be fused if no floor is found";
  EXPECT_EQ(reconstruct(input + " --set map/level=imu").exit_code, 1);
}

/// Each process finds the same levelling transform, although it maps only one box.
TEST_F(LevelProgram, BoxesGiveTheMapOfOneRun) {
  const std::string input =
      "--tum " + in("first") + " --frames 0:11 --poses-mode tf --set map/level=floor --save-map ";
  ASSERT_EQ(reconstruct(input + in("whole.dtsdf")).exit_code, 0);
  for (const char* box : {"x=..0.64", "x=0.64.."}) {
    const Outcome outcome =
        reconstruct(input + in(std::string(box) + ".dtsdf") + " --only " + box + ",y=..,z=..");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  const Outcome outcome = run(std::string(DTSDF_MAP_TOOL) + " join " + in("x=*.dtsdf") +
                              " --save-map " + in("joined.dtsdf"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(readBytes(in("joined.dtsdf")) == readBytes(in("whole.dtsdf")));
  EXPECT_TRUE(loadMap(in("joined.dtsdf")).T_W_M);
}

}  // namespace
}  // namespace dtsdf
