// reconstruct reads a frame log: to the map that was logged, or to that of corrected poses.
#include <gtest/gtest.h>

#include "io/trajectory.h"
#include "support/logged_map.h"
#include "support/run_program.h"

namespace dtsdf {
namespace {

Outcome runReconstruct(const TemporaryFolder& folder, const std::string& arguments) {
  return runIn(folder, DTSDF_RECONSTRUCT " " + folder / "log" + " " + arguments);
}

class LogProgram : public testing::Test {
 protected:
  LogProgram() : images_(roomImages(6)) {
    params_ = makeCpuParams();
    params_.map.voxel_size_m = 0.05f;
    params_.map.max_memory_mb = 256;
    FrameLog log(logOptions(folder_ / "log"));
    PoseParams poses;
    poses.mode = PoseMode::kTrack;
    LoggedMap live(params_, log, poses);
    for (size_t i = 0; i < images_.size(); ++i) {
      live.fuse(movedTo(images_[i], wrongPose(i)), 0.1 * static_cast<double>(i));
    }
    live.clearRegion(SphereRegion{Eigen::Vector3d(1.0, 0.5, 0.5), 0.8});
    live_hash_ = contentHash(live.mapper().contents());
  }

  Eigen::Isometry3d wrongPose(size_t i) const {
    return Eigen::Translation3d(0.0, 0.02 * static_cast<double>(i), 0.0) * images_[i].frame.T_W_C;
  }

  TemporaryFolder folder_;
  std::vector<SceneFrame> images_;
  MapperParams params_;
  uint64_t live_hash_ = 0;
};

TEST_F(LogProgram, MakesTheMapThatWasLogged) {
  const Outcome outcome =
      runReconstruct(folder_, "--backend cpu --save-map " + folder_ / "map.dtsdf");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const MapInfo info = readMapInfo(folder_ / "map.dtsdf");
  EXPECT_EQ(info.content_hash, live_hash_);
  EXPECT_EQ(info.stamp_s, 0.5);
  EXPECT_EQ(info.map_frame, "map");
  EXPECT_EQ(info.poses.mode, PoseMode::kTrack) << "they are the node's, not of this run";
}

TEST_F(LogProgram, WritesThePosesAlone) {
  const Outcome outcome =
      runReconstruct(folder_, "--backend cpu --trajectory " + folder_ / "poses.txt");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<StampedPose> poses = readTrajectory(folder_ / "poses.txt", "").poses();
  ASSERT_EQ(poses.size(), images_.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    EXPECT_NEAR(poses[i].stamp_s, 0.1 * static_cast<double>(i), 1e-9);
    EXPECT_TRUE(poses[i].T_W_C.isApprox(wrongPose(i), 1e-8)) << "as they were fused";
  }
}

TEST_F(LogProgram, MakesTheMapOfCorrectedPoses) {
  std::vector<StampedPose> poses;
  const auto plain = makeMapper(params_);
  for (size_t i = 0; i < images_.size(); ++i) {
    poses.push_back({0.1 * static_cast<double>(i), images_[i].frame.T_W_C});
  }
  saveTrajectory(poses, folder_ / "poses.txt");
  // As they are read from the file, whose digits end; the first has not moved.
  const std::vector<StampedPose> read = readTrajectory(folder_ / "poses.txt", "").poses();
  for (size_t i = 0; i < images_.size(); ++i) {
    plain->integrate(movedTo(images_[i], i == 0 ? wrongPose(0) : read[i].T_W_C).view());
  }
  plain->clearRegion(SphereRegion{Eigen::Vector3d(1.0, 0.5, 0.5), 0.8});
  const Outcome outcome =
      runReconstruct(folder_, "--backend cpu --corrected-poses " + folder_ / "poses.txt" +
                                  " --save-map " + folder_ / "map.dtsdf");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("5 of 6 depth images"), std::string::npos) << outcome.out;
  const uint64_t hash = readMapInfo(folder_ / "map.dtsdf").content_hash;
  EXPECT_EQ(hash, contentHash(plain->contents()));
  EXPECT_NE(hash, live_hash_);
}

TEST_F(LogProgram, RefusesSettingsOfRecordings) {
  for (const std::string key : {"poses/mode=refine", "map/level=floor", "colour/max_rate_hz=1"}) {
    const Outcome outcome =
        runReconstruct(folder_, "--set " + key + " --mesh " + folder_ / "mesh.ply");
    EXPECT_EQ(outcome.exit_code, 2) << key;
    EXPECT_NE(outcome.err.find("is for recordings"), std::string::npos) << outcome.err;
  }
}

TEST_F(LogProgram, RefusesPosesOfOtherStamps) {
  saveTrajectory({{500.0, images_[0].frame.T_W_C}}, folder_ / "poses.txt");
  const Outcome outcome =
      runReconstruct(folder_, "--backend cpu --corrected-poses " + folder_ / "poses.txt" +
                                  " --save-map " + folder_ / "map.dtsdf");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("no corrected pose has the stamp"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace dtsdf
