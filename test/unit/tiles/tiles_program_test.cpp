/// Runs the program `tiles` as a user does, and compares it with `reconstruct`.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "support/run_program.h"
#include "support/scene_colours.h"

namespace dtsdf {
namespace {

constexpr int kFrames = 16, kEmptyFrame = 5;

/// A lap through the room, and the mesh and the map that `reconstruct` makes of it.
struct Recorded {
  Recorded() {
    std::vector<Eigen::Isometry3d> poses;
    for (int i = 0; i < kFrames; ++i) poses.push_back(roomCameraPose(1.6 * i));
    // One frame in between shows nothing, and is not part of the map.
    poses[kEmptyFrame] = lookAt({0.0, 0.0, 5.0}, {0.0, 0.0, 9.0}, Eigen::Vector3d::UnitX());
    // The room twice, far from each other: tiles of one need no frames of the other, and the mesh
    // has an origin of its own.
    const auto moved = [](size_t i, const Eigen::Isometry3d& T_W_C) -> Eigen::Isometry3d {
      return Eigen::Translation3d(i < kFrames / 2 ? 0.0 : 120.0, 0.0, 0.0) * T_W_C;
    };
    writeSceneRecording(recording.path(), makeRoomScene(), poses, 80, 60, moved);
    const Outcome outcome =
        runIn(out, DTSDF_RECONSTRUCT " " + recording.path() + settings() + "--mesh " +
                       (out / "one.ply") + " --save-map " + (out / "one.dtsdf"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    mesh = readBytes(out / "one.ply");
    map = readBytes(out / "one.dtsdf");
    EXPECT_GT(mesh.size(), 50000u);
  }

  static std::string settings() {
    return " --backend cpu --threads 1 --set map/voxel_size_m=0.08 mesh/min_support=1 "
           "poses/mode=tf ";
  }

  TemporaryFolder recording, out;
  std::string mesh, map;
};

class TilesProgram : public testing::Test {
 protected:
  static void SetUpTestSuite() { recorded_ = new Recorded(); }
  static void TearDownTestSuite() {
    delete recorded_;
    recorded_ = nullptr;
  }

  Outcome tiles(const std::string& arguments) const {
    return runIn(out_, DTSDF_TILES " " + arguments);
  }

  void expectDone(const std::string& arguments) const {
    const Outcome outcome = tiles(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.err;
  }

  void expectError(const std::string& arguments, const std::string& text) const {
    const Outcome outcome = tiles(arguments);
    EXPECT_NE(outcome.exit_code, 0) << arguments;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }

  std::string folder() const { return out_ / "plan"; }
  std::string file(const std::string& name) const { return out_ / ("plan/tiles/" + name); }

  void plan(const std::string& more = "--tile-m 4", const std::string& recordings = "") const {
    expectDone("plan " + (recordings.empty() ? recorded_->recording.path() : recordings) +
               Recorded::settings() + "--out " + folder() + " " + more);
  }

  nlohmann::json planJson() const {
    return nlohmann::json::parse(readBytes(out_ / "plan/plan.json"));
  }
  size_t tileCount() const { return planJson()["tiles"].size(); }

  void fuseAll() const {
    for (size_t i = 0; i < tileCount(); ++i) {
      expectDone("fuse " + folder() + " " + std::to_string(i) + " --threads 1");
    }
  }

  std::string mergeArguments() const {
    return "merge " + folder() + " --mesh " + (out_ / "all.ply") + " --save-map " +
           (out_ / "all.dtsdf");
  }

  void expectSameAsOneProcess() const {
    expectDone(mergeArguments());
    EXPECT_TRUE(readBytes(out_ / "all.ply") == recorded_->mesh);
    EXPECT_TRUE(readBytes(out_ / "all.dtsdf") == recorded_->map);
  }

  static Recorded* recorded_;
  const TemporaryFolder out_;
};

Recorded* TilesProgram::recorded_ = nullptr;

TEST_F(TilesProgram, MakesTheBytesOfOneProcess) {
  plan();
  EXPECT_GT(tileCount(), 8u);
  EXPECT_EQ(planJson()["recordings"][0]["fused"].size(), 2u) << "before and behind the empty one";
  EXPECT_NE(readBytes(out_ / "plan/plan.svg").find("</svg>"), std::string::npos);
  EXPECT_NE(readBytes(out_ / "plan/plan.txt").find("15 frames"), std::string::npos);
  size_t left_out = 0;
  const nlohmann::json planned = planJson();
  for (const auto& tile : planned["tiles"]) {
    size_t frames = 0;
    for (const auto& range : tile["frames"][0]) frames += size_t(range[1]) - size_t(range[0]) + 1;
    left_out += kFrames - 1 - frames;
  }
  EXPECT_GT(left_out, 0u) << "a tile does not need all frames";
  fuseAll();
  expectSameAsOneProcess();
}

/// Tiles of some megabytes each.
class LargeTiles : public TilesProgram {
 protected:
  static constexpr char kFine[] = "--tile-m 20 --set map/voxel_size_m=0.04 ";

  nlohmann::json planned(const std::string& more) const {
    plan(kFine + more);
    return planJson()["tiles"];
  }

  void expectSameFineMap() const {
    fuseAll();
    expectDone(mergeArguments());
    const Outcome outcome =
        runIn(out_, DTSDF_RECONSTRUCT " " + recorded_->recording.path() + Recorded::settings() +
                        "--set map/voxel_size_m=0.04 --mesh " + (out_ / "one.ply") +
                        " --save-map " + (out_ / "one.dtsdf"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(readBytes(out_ / "all.ply") == readBytes(out_ / "one.ply"));
    EXPECT_TRUE(readBytes(out_ / "all.dtsdf") == readBytes(out_ / "one.dtsdf"));
  }
};

TEST_F(LargeTiles, AreCutWhereTheyTakeMoreThanTheBudget) {
  const nlohmann::json whole = planned(""), cut = planned("map/max_memory_mb=2");
  EXPECT_GT(cut.size(), whole.size());
  for (const auto& tile : cut) EXPECT_LE(tile["most_map_bytes"], 2 << 20);
  expectSameFineMap();
}

TEST_F(LargeTiles, AreKeptOnDiskBeyondTheBudget) {
  const TemporaryFolder pages;
  const nlohmann::json whole = planned(""),
                       paged = planned("map/max_memory_mb=2 map/page_folder=" + pages.path());
  ASSERT_EQ(paged.size(), whole.size());
  size_t on_disk = 0;
  for (size_t i = 0; i < paged.size(); ++i) {
    on_disk += paged[i]["most_map_bytes"] < whole[i]["most_map_bytes"];
  }
  EXPECT_GT(on_disk, 0u);
  expectSameFineMap();
}

TEST_F(TilesProgram, JoinsSeveralRecordings) {
  // The same frames, from two folders.
  const TemporaryFolder first, second;
  const auto copyPart = [](const TemporaryFolder& to, int begin, int end) {
    const std::string from = recorded_->recording.path();
    std::filesystem::copy(from, to.path(), std::filesystem::copy_options::recursive);
    std::istringstream lines(readBytes(to / "depth.txt"));
    std::string part, line;
    for (int i = 0; std::getline(lines, line); ++i) {
      if (i >= begin && i < end) part += line + "\n";
    }
    writeBytes(to / "depth.txt", part);
  };
  copyPart(first, 0, 7);
  copyPart(second, 7, kFrames);
  plan("--tile-m 5", first.path() + " " + second.path());
  fuseAll();
  expectSameAsOneProcess();
}

TEST_F(TilesProgram, NamesTilesThatAreNotThereOrDamaged) {
  plan("--tile-m 6");
  expectError(mergeArguments(), "tiles are not done (0: ");
  fuseAll();
  EXPECT_NE(tiles("fuse " + folder() + " 1").out.find("tile 1 is already done"), std::string::npos);
  for (const std::string name : {"0001.dtsdf", "0001.mesh"}) {
    const std::string sound = readBytes(file(name));
    std::string damaged = sound;
    damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 4);
    writeBytes(file(name), damaged);
    expectError(mergeArguments(), "tile 1 cannot be merged");
    writeBytes(file(name), sound.substr(0, sound.size() / 2));
    expectError(mergeArguments(), "1: its m");
    // One that another run has made is no better.
    writeBytes(file(name), readBytes(file(name[5] == 'd' ? "0000.dtsdf" : "0000.mesh")));
    expectError(mergeArguments(), "1");
    writeBytes(file(name), sound);
  }
  EXPECT_FALSE(std::filesystem::exists(out_ / "all.ply"));
  std::filesystem::remove(file("0001.json"));
  EXPECT_NE(tiles("status " + folder()).out.find("1 waiting"), std::string::npos);
  expectDone("fuse " + folder() + " 1");
  expectSameAsOneProcess();
  plan("--tile-m 5");
  expectError(mergeArguments(), "it belongs to another plan");
}

TEST_F(TilesProgram, RefusesWhatWouldChangeTheResult) {
  const std::string begin = "plan " + recorded_->recording.path() + " --out " + folder() + " ";
  expectError(begin + "--set map/keep_radius_m=3", "map/keep_radius_m");
  plan("--tile-m 4");
  // A budget that a map has outgrown fails the tile.
  auto json = planJson();
  json["settings"]["map/max_memory_mb"] = 1;
  writeBytes(out_ / "plan/plan.json", json.dump());
  size_t largest = 0;
  for (size_t i = 0; i < json["tiles"].size(); ++i) {
    const auto bytes = [&](size_t tile) { return size_t(json["tiles"][tile]["most_map_bytes"]); };
    if (bytes(i) > bytes(largest)) largest = i;
  }
  expectError("fuse " + folder() + " " + std::to_string(largest), "takes more than its budget");
  EXPECT_NE(tiles("status " + folder())
                .out.find(std::to_string(largest) + "  failed: the tile takes more"),
            std::string::npos);
  expectError("fuse " + folder() + " 99", "the plan has no tile '99'");
  writeBytes(out_ / "plan/plan.json", "{}");
  expectError("status " + folder(), "is not a plan");
}

TEST_F(TilesProgram, MakesTheFolderOfTheLogsOfSlurm) {
  plan("--tile-m 20");
  EXPECT_FALSE(std::filesystem::exists(out_ / "plan/tiles"));
  const Outcome outcome = tiles("slurm " + folder() + " --backend cuda");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("#SBATCH --output=\"" + folder() + "/tiles/slurm-%A_%a.log\"\n"),
            std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("#SBATCH --gres=gpu:1\n"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_directory(out_ / "plan/tiles"));
  EXPECT_EQ(tiles("slurm " + folder() + " --backend gpu").exit_code, 2);
  EXPECT_EQ(tiles("slurm " + folder() + " --threads 0").exit_code, 2);
}

TEST_F(TilesProgram, TellsOfImagesThatHaveChanged) {
  const TemporaryFolder copy;
  std::filesystem::copy(recorded_->recording.path(), copy.path(),
                        std::filesystem::copy_options::recursive);
  plan("--tile-m 20", copy.path());
  for (int i = 0; i < kFrames; ++i) {
    if (i == kEmptyFrame) continue;
    std::filesystem::copy(copy / "depth/5.png", copy / ("depth/" + std::to_string(i) + ".png"),
                          std::filesystem::copy_options::overwrite_existing);
  }
  expectError("fuse " + folder() + " 0", "has changed since the plan was made");
}

/// The room with a box in it, with colour and what is free.
TEST_F(TilesProgram, MakesTheSameColoursAndFreeCells) {
  const TemporaryFolder recording;
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 8; ++i) poses.push_back(roomCameraPose(3.0 * i));
  Scene scene = makeRoomScene();
  scene.add(makeBox({1.6, 1.2, 0.8}, {0.5, 0.5, 0.5}, 0.3));
  writeSceneRecording(recording.path(), scene, poses, 80, 60);
  writeSceneColours(recording.path(), scene, wavesAt, poses, 80, 60);
  const std::string fixed = "colour/exposure=fixed ", depth = "colour/max_depth_m=1.8 ";
  const std::string space = "space/enabled=true space/max_range_m=3 space/cell_voxels=2 ";
  const auto planWith = [&](const std::string& more) {
    return "plan " + recording.path() + Recorded::settings() + more + "--out " + folder() +
           " --tile-m 3.2";  // 5 blocks: cubes of two lie across the borders
  };
  expectError(planWith(fixed), "colour/max_depth_m=5");
  expectError(planWith(depth), "colour/exposure=fixed");
  const Outcome one = runIn(out_, DTSDF_RECONSTRUCT " " + recording.path() + Recorded::settings() +
                                      fixed + depth + space + "--mesh " + (out_ / "one.ply") +
                                      " --save-map " + (out_ / "one.dtsdf"));
  ASSERT_EQ(one.exit_code, 0) << one.err;
  expectDone(planWith(fixed + depth + space));
  const nlohmann::json planned = planJson();
  EXPECT_EQ(planned["recordings"][0]["images"].size(), 7u) << "none after the last frame";
  size_t images = 0, only_free = 0;
  for (const auto& tile : planned["tiles"]) {
    only_free += tile["most_own_blocks"] == 0;
    for (const auto& range : tile["images"][0]) images += size_t(range[1]) - size_t(range[0]) + 1;
  }
  EXPECT_GT(images, 0u);
  EXPECT_LT(images, 7 * planned["tiles"].size()) << "a tile does not take all images";
  EXPECT_GT(only_free, 0u) << "where frames only look through, there are tiles too";
  fuseAll();
  expectDone(mergeArguments());
  EXPECT_TRUE(readBytes(out_ / "all.ply") == readBytes(out_ / "one.ply"));
  EXPECT_TRUE(readBytes(out_ / "all.dtsdf") == readBytes(out_ / "one.dtsdf"));
  nlohmann::json disordered = planned;
  disordered["recordings"][0]["images"][3][1] = 0;
  writeBytes(out_ / "plan/plan.json", disordered.dump());
  expectError("status " + folder(), "colour images are not in order");
  const Outcome info = runIn(out_, DTSDF_MAP_TOOL " info " + (out_ / "all.dtsdf"));
  EXPECT_NE(info.out.find("free"), std::string::npos) << info.out;
}

// Two views of opposite walls: what lies between is only looked through, and nothing is cleared.
TEST_F(TilesProgram, GivesTilesTheFramesThatSeeThroughThem) {
  const TemporaryFolder recording;
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  writeSceneRecording(recording.path(), makeRoomScene(),
                      {lookAt({1.9, 0.1, 1.3}, {-2.0, 0.2, 1.2}, up),
                       lookAt({-1.9, 0.3, 1.2}, {2.0, 0.1, 1.3}, up)},
                      80, 60);
  const std::string settings = recording.path() + Recorded::settings() +
                               "space/enabled=true space/cell_voxels=2 fusion/clearing=false ";
  const Outcome one =
      runIn(out_, DTSDF_RECONSTRUCT " " + settings + "--save-map " + (out_ / "one.dtsdf"));
  ASSERT_EQ(one.exit_code, 0) << one.err;
  expectDone("plan " + settings + "--out " + folder() + " --tile-m 2");
  fuseAll();
  expectDone("merge " + folder() + " --save-map " + (out_ / "all.dtsdf"));
  EXPECT_TRUE(readBytes(out_ / "all.dtsdf") == readBytes(out_ / "one.dtsdf"));
}

}  // namespace
}  // namespace dtsdf
