// Tests that reconstruct fuses the node's map again from a journal, with the same or with corrected
// poses, and that map_tool exports the journal's images.
#include <gtest/gtest.h>

#include "io/trajectory.h"
#include "support/journaled_map.h"
#include "support/run_program.h"

namespace dtsdf {
namespace {

class JournalProgram : public testing::Test {
 protected:
  JournalProgram() : images_(roomImages(6)) {
    params_ = makeCpuParams();
    params_.map.voxel_size_m = 0.05f;
    params_.map.max_memory_mb = 256;
    JournalWriter journal(journalOptions(folder_ / "journals"));
    path_ = journal.path();
    PoseParams poses;
    poses.mode = PoseMode::kTrack;
    JournaledMap live(params_, journal, poses);
    for (size_t i = 0; i < images_.size(); ++i) {
      live.fuse(withPose(images_[i], wrongPose(i)), 0.1 * static_cast<double>(i));
    }
    live.clearRegion(SphereRegion{Eigen::Vector3d(1.0, 0.5, 0.5), 0.8});
    live_hash_ = contentHash(live.mapper().contents());
  }

  Outcome runReconstruct(const std::string& arguments) const {
    return runIn(folder_, DTSDF_RECONSTRUCT " " + path_ + " " + arguments);
  }

  Eigen::Isometry3d wrongPose(size_t i) const {
    return Eigen::Translation3d(0.0, 0.02 * static_cast<double>(i), 0.0) * images_[i].frame.T_W_C;
  }

  TemporaryFolder folder_;
  std::vector<SceneFrame> images_;
  MapperParams params_;
  std::string path_;
  uint64_t live_hash_ = 0;
};

TEST_F(JournalProgram, ReproducesTheNodesMap) {
  const Outcome outcome = runReconstruct("--backend cpu --save-map " + folder_ / "map.dtsdf");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const MapInfo info = readMapInfo(folder_ / "map.dtsdf");
  EXPECT_EQ(info.content_hash, live_hash_);
  EXPECT_EQ(info.stamp_s, 0.5);
  EXPECT_EQ(info.map_frame, "map");
  EXPECT_EQ(info.poses.mode, PoseMode::kTrack) << "the map should have the node's pose mode";
}

TEST_F(JournalProgram, WritesPosesWithoutAMap) {
  const Outcome outcome = runReconstruct("--backend cpu --trajectory " + folder_ / "poses.txt");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<StampedPose> poses = readTrajectory(folder_ / "poses.txt", "").poses();
  ASSERT_EQ(poses.size(), images_.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    EXPECT_NEAR(poses[i].stamp_s, 0.1 * static_cast<double>(i), 1e-9);
    EXPECT_TRUE(poses[i].T_W_C.isApprox(wrongPose(i), 1e-8));
  }
}

TEST_F(JournalProgram, FusesCorrectedPoses) {
  std::vector<StampedPose> poses;
  const auto plain = makeMapper(params_);
  for (size_t i = 0; i < images_.size(); ++i) {
    poses.push_back({0.1 * static_cast<double>(i), images_[i].frame.T_W_C});
  }
  saveTrajectory(poses, folder_ / "poses.txt");
  // The expected map uses the rounded poses from the file. The first pose was correct, so it is not
  // changed.
  const std::vector<StampedPose> read = readTrajectory(folder_ / "poses.txt", "").poses();
  for (size_t i = 0; i < images_.size(); ++i) {
    plain->integrate(withPose(images_[i], i == 0 ? wrongPose(0) : read[i].T_W_C).view());
  }
  plain->clearRegion(SphereRegion{Eigen::Vector3d(1.0, 0.5, 0.5), 0.8});
  const Outcome outcome = runReconstruct("--backend cpu --poses " + folder_ / "poses.txt" +
                                         " --save-map " + folder_ / "map.dtsdf");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("5 of 6 depth images"), std::string::npos) << outcome.out;
  const uint64_t hash = readMapInfo(folder_ / "map.dtsdf").content_hash;
  EXPECT_EQ(hash, contentHash(plain->contents()));
  EXPECT_NE(hash, live_hash_);
}

TEST_F(JournalProgram, RefusesSettingsForRecordings) {
  for (const std::string key : {"poses/mode=refine", "map/level=floor", "colour/max_rate_hz=1"}) {
    const Outcome outcome = runReconstruct("--set " + key + " --mesh " + folder_ / "mesh.ply");
    EXPECT_EQ(outcome.exit_code, 2) << key << outcome.err;
    const std::string name = key.substr(0, key.find('='));
    EXPECT_NE(outcome.err.find("error: " + name + " is for recordings"), std::string::npos)
        << outcome.err;
  }
}

TEST_F(JournalProgram, RefusesPosesInAnotherFrame) {
  saveTrajectory({{0.1, images_[1].frame.T_W_C}}, folder_ / "poses.txt");
  const std::string arguments =
      "--backend cpu --poses " + folder_ / "poses.txt" + " --save-map " + folder_ / "map.dtsdf";
  EXPECT_EQ(runReconstruct(arguments + " --poses-frame map").exit_code, 0);
  EXPECT_EQ(runReconstruct(arguments + " --poses-frame odom").exit_code, 2);
}

TEST_F(JournalProgram, ExportsImagesForSplatTraining) {
  const std::string out = folder_ / "splats";
  const Outcome outcome =
      runIn(folder_, DTSDF_MAP_TOOL " export " + path_ + " --transforms " + out);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string json = readBytes(out + "/transforms.json");
  for (const std::string key :
       {"\"camera_model\": \"PINHOLE\"", "depth/000005.png", "\"w\": 80", "points.ply"}) {
    EXPECT_NE(json.find(key), std::string::npos) << key << " in " << json;
  }
  EXPECT_EQ(json.find("depth/000006.png"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(out + "/depth/000005.png"));
  EXPECT_EQ(readBytes(out + "/points.ply").find("ply\nformat binary_little_endian"), 0u);
}

}  // namespace
}  // namespace dtsdf
