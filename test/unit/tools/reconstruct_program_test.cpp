/// Tests the exit codes, error messages and output files of the program `reconstruct`.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "dtsdf_mapping/io/map_file.h"
#include "io/trajectory.h"
#include "support/furnished_room.h"
#include "support/run_program.h"
#include "support/scene_recording.h"
#include "support/tum_folder.h"

namespace dtsdf {
namespace {

class ReconstructProgram : public testing::Test {
 protected:
  void SetUp() override {
    writeTumFolder(tum_, 6, 80, 60);
    // Each image covers a different area, so every surface is visible in only one image.
    tum_option_ = "--tum " + tum_.path() + " --poses-mode tf --set mesh/min_support=1 ";
  }

  Outcome run(const std::string& arguments, const std::string& program = DTSDF_RECONSTRUCT) const {
    return runIn(out_, program + " " + arguments);
  }

  /// The bytes of the mesh saved by a run.
  std::string meshOf(const std::string& arguments) const {
    const Outcome outcome = run(tum_option_ + "--mesh " + (out_ / "mesh.ply") + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return readBytes(out_ / "mesh.ply");
  }

  void expectError(const std::string& arguments, int exit_code, const std::string& text) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << "\n" << outcome.err;
    EXPECT_EQ(outcome.err.find("reconstruct: error: "), 0u) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }

  TemporaryFolder tum_, out_;
  std::string tum_option_;
};

TEST_F(ReconstructProgram, ExplainsAnEmptyMesh) {
  expectError(
      "--tum " + tum_.path() + " --frames 0:5:5 --set backend=cpu --mesh " + (out_ / "mesh.ply"), 1,
      "--set mesh/min_support=1");
}

TEST_F(ReconstructProgram, SavesMeshAndReport) {
  const Outcome outcome = run(tum_option_ + "--backend cpu --threads 1 --mesh-every 2 --mesh " +
                              (out_ / "new/mesh.ply") + " --report " + (out_ / "report.json"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");  // no progress bar without a terminal
  const auto report = nlohmann::json::parse(readBytes(out_ / "report.json"));
  EXPECT_EQ(report["backend"], "cpu");
  EXPECT_EQ(report["frames"], 6);
  EXPECT_GT(report["integrate_ms"]["median"], 0.0);
  EXPECT_GT(report["mesh_ms"]["mean"], 0.0);
  const std::string ply = readBytes(out_ / "new/mesh.ply");
  const auto has = [&](const std::string& line) { return ply.find(line) != std::string::npos; };
  EXPECT_TRUE(has("element vertex " + report["vertices"].dump() + "\n"));
  EXPECT_TRUE(has("element face " + report["triangles"].dump() + "\n"));
  EXPECT_GT(report["triangles"], 100);
}

TEST_F(ReconstructProgram, GuessesTheInputFormat) {
  const std::string mesh = meshOf("");
  const std::string to_mesh = " --mesh " + (out_ / "guessed.ply");
  const Outcome outcome = run(tum_.path() + to_mesh + " --poses-mode tf --set mesh/min_support=1");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("tum: 6 images of 80 x 60"), 0u) << outcome.out;
  EXPECT_TRUE(readBytes(out_ / "guessed.ply") == mesh);
  expectError(out_.path() + to_mesh, 1, "known format");
  expectError(tum_.path() + to_mesh + " --depth-topic /d", 2, "tum");
}

TEST_F(ReconstructProgram, WarnsOfImplausibleImages) {
  const std::string arguments = tum_option_ + "--mesh " + (out_ / "mesh.ply") + " ";
  const Outcome scaled = run(arguments + "--depth-scale 0.5");
  EXPECT_EQ(scaled.err.find("reconstruct: warning: median depth 6000 m"), 0u) << scaled.err;
  for (int i = 0; i < 6; ++i) {
    cv::imwrite(tum_ / ("depth/" + std::to_string(i) + ".png"),
                cv::Mat(60, 80, CV_16UC1, cv::Scalar(0)));
  }
  const Outcome empty = run(arguments);
  EXPECT_EQ(empty.err.find("reconstruct: warning: the first images"), 0u) << empty.err;
  EXPECT_NE(empty.out.find("median depth unknown, 0 %"), std::string::npos) << empty.out;
}

TEST_F(ReconstructProgram, ReportsHowManyImagesHavePoses) {
  writeBytes(tum_ / "groundtruth.txt", "100 0 0 0 0 0 0 1\n");
  const std::string arguments = tum_option_ + "--mesh " + (out_ / "mesh.ply");
  expectError(arguments, 1, "only 1 of 6 images have a pose");
  const Outcome outcome = run(arguments + " --allow-gaps");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string line = outcome.out.substr(0, outcome.out.find('\n'));
  EXPECT_NE(line.find("6 images"), std::string::npos) << line;
  EXPECT_NE(line.find(", 1 with a pose"), std::string::npos) << line;
}

TEST_F(ReconstructProgram, ReportsAFullPageFolder) {
  const Outcome outcome =
      run(tum_option_ + "--mesh " + (out_ / "mesh.ply") + " --set map/voxel_size_m=0.02 " +
          "--set map/max_memory_mb=1 --set map/page_max_gb=0.001 --set map/page_folder=" +
          (out_ / "pages"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("map/page_max_gb"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("lost"), std::string::npos) << outcome.err;
}

/// Meshes that do not fit into an eighth of the budget are written to disk. Simplified or not, the
/// saved file equals one saved without paging.
TEST_F(ReconstructProgram, SavesMeshesThatArePartlyOnDisk) {
  const TemporaryFolder room;
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 8; ++i) poses.push_back(roomCameraPose(1.6 * i));
  writeSceneRecording(room.path(), makeRoomScene(), poses, 80, 60,
                      [](size_t, const Eigen::Isometry3d& T_W_C) { return T_W_C; });
  const auto saved = [&](const std::string& settings) {
    const Outcome outcome =
        run("--tum " + room.path() + " --backend cpu --mesh " + (out_ / "mesh.ply") +
            " --set map/voxel_size_m=0.04 mesh/min_support=1 poses/mode=tf " + settings);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return readBytes(out_ / "mesh.ply");
  };
  const std::string paged = "map/max_memory_mb=2 map/page_folder=" + (out_ / "pages");
  const std::string whole = saved("");
  EXPECT_GT(whole.size(), 4u * (2 << 20) / 8);
  EXPECT_TRUE(saved(paged) == whole);
  const std::string simplified = saved("--simplify-error 0.005");
  EXPECT_TRUE(saved(paged + " --simplify-error 0.005") == simplified);
}

TEST_F(ReconstructProgram, MeshDoesNotDependOnThreadsOrUpdates) {
  const std::string mesh = meshOf("--threads 1");
  EXPECT_EQ(meshOf("--threads 1"), mesh);
  EXPECT_EQ(meshOf("--threads 2"), mesh);
  EXPECT_EQ(meshOf("--mesh-every 1"), mesh);
  EXPECT_EQ(meshOf("--mesh-every 4"), mesh);
  EXPECT_NE(meshOf("--set map/voxel_size_m=0.05"), mesh);
  EXPECT_NE(meshOf("--set mesh/colour=plain"), mesh);
}

/// The settings file may be that of the node, with settings such as map_frame.
TEST_F(ReconstructProgram, CommandLineOverridesConfigFile) {
  writeBytes(out_ / "a.yaml",
             "backend: cuda\nthreads: 1\nmap_frame: odom\nmap:\n  voxel_size_m: 0.05\n");
  const std::string config = "--config " + (out_ / "a.yaml") + " --backend cpu ";
  EXPECT_EQ(meshOf(config), meshOf("--set map/voxel_size_m=0.05"));
  EXPECT_EQ(meshOf(config + "--set map/voxel_size_m=0.04"), meshOf("--set map/voxel_size_m=0.04"));
}

TEST_F(ReconstructProgram, ContinuesALoadedMapExactly) {
  const std::string cpu = "--backend cpu --set map/voxel_size_m=0.03 ";
  const std::string mesh = meshOf(cpu + "--save-map " + (out_ / "whole.dtsdf"));
  const std::string half = " --load-map " + (out_ / "half.dtsdf") + " ";
  const std::string to_half = "--frames :2 --save-map " + (out_ / "half.dtsdf");
  ASSERT_EQ(run(tum_option_ + cpu + to_half).exit_code, 0);
  EXPECT_TRUE(meshOf("--backend cpu --frames 3:" + half + "--save-map " + (out_ / "both.dtsdf")) ==
              mesh);
  EXPECT_TRUE(readBytes(out_ / "both.dtsdf") == readBytes(out_ / "whole.dtsdf"));
  EXPECT_TRUE(meshOf(cpu + "--frames 3:" + half) == mesh);

  const std::string to_mesh = "--mesh " + (out_ / "new.ply") + " ";
  expectError(tum_option_ + to_mesh + "--set map/voxel_size_m=0.05" + half, 1, "map/voxel_size_m");
  expectError(tum_option_ + to_mesh + "--set map/max_memory_mb=1" + half, 1, "map/max_memory_mb");
  expectError(tum_option_ + to_mesh + "--load-map /nowhere.dtsdf", 1, "/nowhere.dtsdf");
  expectError(tum_option_ + "--save-map map.ply", 2, ".dtsdf");
}

TEST_F(ReconstructProgram, MapToolDescribesAndMeshesASavedMap) {
  const std::string file = out_ / "map.dtsdf";
  const std::string mesh =
      meshOf("--backend cpu --set map/voxel_size_m=0.03 map_frame=hall --save-map " + file);
  const Outcome info = run("info " + file + " --settings --verify", DTSDF_MAP_TOOL);
  EXPECT_EQ(info.exit_code, 0) << info.err;
  for (const char* text : {"0.03 m", "'hall'", "mesh/min_support: 1"}) {
    EXPECT_NE(info.out.find(text), std::string::npos) << text << " is not in\n" << info.out;
  }
  const std::string arguments = "mesh " + file + " " + (out_ / "tool.ply") + " --set backend=cpu";
  ASSERT_EQ(run(arguments, DTSDF_MAP_TOOL).exit_code, 0);
  EXPECT_TRUE(readBytes(out_ / "tool.ply") == mesh);
  ASSERT_EQ(run(arguments + " mesh/refine=1", DTSDF_MAP_TOOL).exit_code, 0);
  EXPECT_GT(readBytes(out_ / "tool.ply").size(), 2 * mesh.size());

  std::string bytes = readBytes(file);
  bytes[bytes.size() / 2] = static_cast<char>(~bytes[bytes.size() / 2]);
  writeBytes(file, bytes);
  EXPECT_EQ(run("info " + file, DTSDF_MAP_TOOL).exit_code, 0)
      << "`info` should not read the damaged record";
  EXPECT_EQ(run("info " + file + " --verify", DTSDF_MAP_TOOL).exit_code, 1);
  EXPECT_EQ(run("mesh " + file + " " + (out_ / "tool.ply"), DTSDF_MAP_TOOL).exit_code, 1);
  EXPECT_EQ(run("", DTSDF_MAP_TOOL).exit_code, 2);
  EXPECT_EQ(run("draw " + file, DTSDF_MAP_TOOL).exit_code, 2);
}

TEST_F(ReconstructProgram, WrongArgumentsExitWith2) {
  expectError("", 2, "--tum and --bag");
  expectError(tum_option_, 2, "--mesh");
  expectError(tum_option_ + "--mesh a.ply --set map/voxel_sise_m=1 map/voxel_size_m=x", 2,
              "map/voxel_sise_m");
  EXPECT_EQ(run("--help").exit_code, 0);
}

TEST_F(ReconstructProgram, ErrorsExitWith1AndKeepTheOldMesh) {
  const std::string mesh = "--mesh " + (out_ / "mesh.ply") + " ";
  writeBytes(out_ / "mesh.ply", "old");
  expectError("--tum /nowhere " + mesh, 1, "/nowhere");
  expectError(tum_option_ + mesh + "--config /nowhere.yaml", 1, "/nowhere.yaml");
  std::filesystem::create_symlink("loop", out_ / "loop");
  expectError((out_ / "loop") + " " + mesh, 1, "is a link that leads to itself");
  expectError(tum_option_ + mesh + "--frames 6:", 1, "there are 6, numbered 0 to 5");
  expectError(tum_option_ + "--mesh /dev/null/mesh.ply", 1, "/dev/null");
  writeBytes(tum_ / "depth/3.png", "damaged");
  expectError(tum_option_ + mesh, 1, "depth/3.png");
  EXPECT_EQ(readBytes(out_ / "mesh.ply"), "old");
}

TEST_F(ReconstructProgram, SimplifiesOnRequest) {
  const std::string arguments = tum_option_ + "--mesh " + (out_ / "mesh.ply");
  const auto triangles = [](const std::string& ply) {
    return std::stoul(ply.substr(ply.find("element face ") + 13));
  };
  ASSERT_EQ(run(arguments).exit_code, 0);
  const size_t before = triangles(readBytes(out_ / "mesh.ply"));
  const Outcome outcome = run(arguments + " --simplify-error 0.01");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find(std::to_string(before)), std::string::npos) << outcome.out;
  EXPECT_LT(triangles(readBytes(out_ / "mesh.ply")), before / 2);
  ASSERT_EQ(run(arguments + " --simplify-error 0").exit_code, 0);
  EXPECT_EQ(triangles(readBytes(out_ / "mesh.ply")), before);
  expectError(arguments + " --simplify-error -0.1", 2, "--simplify-error");
  expectError(arguments + " --simplify-error 1000", 2, "larger than the whole mesh");
}

/// A recording of a corner of a room by a slowly moving camera. All poses except the first are 45
/// mm off, in alternating directions.
TEST_F(ReconstructProgram, RefinesAndTracksPoses) {
  Scene corner;
  corner.add(Plane{{2.0, 0.0, 0.0}, -Eigen::Vector3d::UnitX()});
  corner.add(Plane{{0.0, 2.0, 0.0}, -Eigen::Vector3d::UnitY()});
  corner.add(Plane{{0.0, 0.0, -1.0}, Eigen::Vector3d::UnitZ()});
  std::vector<Eigen::Isometry3d> truth;
  for (int i = 0; i < 6; ++i) {
    truth.push_back(lookAt({0.3 + 0.02 * i, 0.2, 0.1}, {2.0, 2.0, -1.0}, Eigen::Vector3d::UnitZ()));
  }
  const TemporaryFolder folder;
  writeSceneRecording(folder.path(), corner, truth, 320, 240,
                      [](size_t i, const Eigen::Isometry3d& pose) {
                        const double off_m = i == 0 ? 0.0 : 0.03 * (i % 2 == 0 ? 1.0 : -1.0);
                        return Eigen::Translation3d(off_m, -off_m, 0.5 * off_m) * pose;
                      });
  const std::string command = "--tum " + folder.path() +
                              " --backend cpu --set mesh/min_support=1 --trajectory " +
                              (out_ / "poses.txt") + " --report " + (out_ / "report.json") +
                              " --mesh " + (out_ / "mesh.ply");
  const auto largestError = [&] {
    const Trajectory found = readTrajectory(out_ / "poses.txt", "");
    EXPECT_EQ(found.poses().size(), truth.size());
    double error_m = 0.0;
    for (size_t i = 0; i < found.poses().size(); ++i) {
      error_m =
          std::max(error_m, (found.poses()[i].T_W_C.translation() - truth[i].translation()).norm());
    }
    return error_m;
  };
  const std::vector<std::string> as_given{" --poses-mode tf", " --set poses/mode=tf",
                                          " --poses " + (folder / "groundtruth.txt")};
  for (const std::string& given : as_given) {
    ASSERT_EQ(run(command + given).exit_code, 0);
    EXPECT_GT(largestError(), 0.04) << given;
    EXPECT_EQ(readBytes(out_ / "report.json").find("aligned"), std::string::npos);
  }
  const std::string map = out_ / "map.dtsdf";
  const Outcome refined = run(command + " --save-map " + map);
  ASSERT_EQ(refined.exit_code, 0) << refined.err;
  EXPECT_LT(largestError(), 0.002);
  const auto report = nlohmann::json::parse(readBytes(out_ / "report.json"));
  EXPECT_EQ(report["frames_aligned"]["aligned"], 5);
  EXPECT_NEAR(report["poses_moved"]["mm"]["median"], 45.0, 2.0);
  EXPECT_LT(report["poses_moved"]["points_on_surfaces_before"], 0.6);
  EXPECT_GT(report["poses_moved"]["points_on_surfaces"], 0.9);
  const std::string mesh = readBytes(out_ / "mesh.ply");
  ASSERT_EQ(run(command + " --poses-mode refine").exit_code, 0);
  EXPECT_TRUE(readBytes(out_ / "mesh.ply") == mesh) << "the default should be refine";
  EXPECT_EQ(readMapInfo(map).poses.mode, PoseMode::kRefine);
  // Without poses, the map is in the first camera's frame.
  std::filesystem::remove(folder / "groundtruth.txt");
  const Eigen::Isometry3d first = truth[0];
  for (Eigen::Isometry3d& pose : truth) pose = first.inverse() * pose;
  const Outcome tracked = run(command + " --poses-mode track");
  ASSERT_EQ(tracked.exit_code, 0) << tracked.err;
  EXPECT_LT(largestError(), 0.002);
}

/// Images without poses are taken in a room that was mapped from another recording.
TEST_F(ReconstructProgram, LocalisesInALoadedMap) {
  TemporaryFolder room, later;
  const Scene scene = roomWithFurniture();
  writeSceneRecording(room.path(), scene, viewsAround(), 160, 120);
  const std::string map = out_ / "room.dtsdf";
  const std::string settings =
      " --backend cpu --set map/voxel_size_m=0.04 --trajectory " + (out_ / "poses.txt");
  ASSERT_EQ(run("--tum " + room.path() + settings + " --poses-mode tf --save-map " + map).exit_code,
            0);
  const Eigen::Isometry3d truth = cameraTowards({-0.5, 0.4, 1.4}, -0.3);
  writeSceneRecording(later.path(), scene, std::vector<Eigen::Isometry3d>(4, truth), 160, 120);
  std::filesystem::remove(later / "groundtruth.txt");
  const Outcome outcome = run("--tum " + later.path() + settings + " --poses-mode track" +
                              " --load-map " + map + " --mesh " + (out_ / "mesh.ply"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Trajectory found = readTrajectory(out_ / "poses.txt", "");
  ASSERT_EQ(found.poses().size(), 2u);
  EXPECT_LT((found.poses()[0].T_W_C.translation() - truth.translation()).norm(), 0.02);
}

}  // namespace
}  // namespace dtsdf
