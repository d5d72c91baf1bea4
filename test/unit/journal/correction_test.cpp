// Tests that a corrected map equals, byte for byte, a map fused with the corrected poses.
#include <gtest/gtest.h>

#include "journal/refusion.h"
#include "support/journaled_map.h"

namespace dtsdf {
namespace {

constexpr int kCount = 8;

/// The error in the pose of image i, a rotation and a sideways shift that grow with i.
Eigen::Isometry3d drift(int i) {
  Eigen::Isometry3d T(Eigen::AngleAxisd(0.002 * i, Eigen::Vector3d::UnitZ()));
  T.translation() = Eigen::Vector3d(0.0, 0.01 * i, 0.0);
  return T;
}

/// The images of a lap through the room, and a map that records each fused image in a journal.
class JournalOfALap : public testing::Test {
 protected:
  JournalOfALap()
      : images_(roomImages(2 * kCount)),
        journal_(journalOptions(folder_.path())),
        map_(journaledParams(), journal_) {}

  const SceneFrame& image(int i) const { return images_[static_cast<size_t>(i)]; }
  Eigen::Isometry3d truePose(int i) const { return image(i).frame.T_W_C; }

  void fuse(int i, const Eigen::Isometry3d& T) {
    map_.fuse(withPose(image(i), T * truePose(i)), 0.1 * i);
  }

  std::vector<StampedPose> truePoses(int count = kCount) const {
    std::vector<StampedPose> poses;
    for (int i = 0; i < count; ++i) poses.push_back({0.1 * i, truePose(i)});
    return poses;
  }

  /// Waits until all records have been written to the file, then starts to fuse all images again.
  Refusion refusionOf(const std::vector<StampedPose>& poses) {
    EXPECT_TRUE(journal_.written().get());
    return Refusion(journal_.path(), journaledParams(), {journal_.count(), poses});
  }

  std::string finish(Refusion& refusion) {
    EXPECT_TRUE(journal_.written().get());
    while (refusion.step(0)) {
    }
    return fileOf(*refusion.takeMapper());
  }

  TemporaryFolder folder_;
  const std::vector<SceneFrame> images_;
  JournalWriter journal_;
  JournaledMap map_;
};

class CorrectedJournal : public JournalOfALap {
 protected:
  CorrectedJournal() {
    for (int i = 0; i < kCount; ++i) fuse(i, drift(i));
    EXPECT_TRUE(journal_.written().get());
  }

  std::string trueMap() const {
    const auto mapper = makeMapper(journaledParams());
    for (int i = 0; i < kCount; ++i) mapper->integrate(image(i).view());
    return fileOf(*mapper);
  }
};

TEST_F(CorrectedJournal, GivesTheMapOfTheCorrectedPoses) {
  JournalReplay replay(journal_.path());
  const CorrectionEffect effect = replay.correctGiven(truePoses());
  EXPECT_EQ(effect.moved, size_t{kCount - 1}) << "all poses but the first should be corrected";
  EXPECT_NEAR(effect.farthest_rad, 0.002 * (kCount - 1), 1e-6);
  EXPECT_TRUE(mapOf(replay, journaledParams()) == trueMap());
}

TEST_F(CorrectedJournal, IsFusedAgainWhileBeingWritten) {
  Refusion refusion(journal_.path(), journaledParams(), {journal_.count(), truePoses()});
  EXPECT_EQ(refusion.effect().moved, size_t{kCount - 1});
  EXPECT_TRUE(refusion.step(0));
  // An image that arrives in the meantime gets the same correction as the image before.
  fuse(kCount, refusion.replay().motion().inverse());
  ASSERT_TRUE(journal_.written().get());
  while (refusion.step(0)) {
  }
  EXPECT_EQ(refusion.replay().count(), journal_.count());
  EXPECT_EQ(refusion.fused(), size_t{kCount + 1});
  EXPECT_GT(refusion.takeMesh().size(), 0u);
  const std::string corrected = fileOf(*refusion.takeMapper());
  {
    JournalReplay offline(journal_.path());
    offline.correct({refusion.correction().before, truePoses()});
    EXPECT_TRUE(mapOf(offline, journaledParams()) == corrected);
  }
  // Once the correction is in the journal, a replay restores the corrected map, and correcting it
  // again with the same poses changes nothing.
  journal_.add(refusion.correction());
  ASSERT_TRUE(journal_.written().get());
  EXPECT_TRUE(mapOf(journal_.path(), journaledParams()) == corrected);
  JournalReplay again(journal_.path());
  EXPECT_EQ(again.correctGiven(truePoses()).moved, 0u);
  EXPECT_TRUE(mapOf(again, journaledParams()) == corrected);
}

/// The corrected path may contain a million poses. Only those with the stamp of an image are kept.
TEST_F(CorrectedJournal, KeepsOnlyPosesOfImages) {
  std::vector<StampedPose> poses = truePoses();
  for (int i = 0; i < 1000000; ++i) poses.push_back({1000.0 + i, Eigen::Isometry3d::Identity()});
  const PoseCorrection correction(poses, JournalReplay(journal_.path()).firstCamera());
  EXPECT_EQ(correction.used().size(), size_t{kCount});
  JournalReplay replay(journal_.path());
  EXPECT_EQ(replay.correct({replay.count(), correction.used()}).moved, size_t{kCount - 1});
  EXPECT_TRUE(mapOf(replay, journaledParams()) == trueMap());
}

TEST_F(CorrectedJournal, NeedsBudgetForTwoMaps) {
  Refusion refusion(journal_.path(), journaledParams(), {journal_.count(), truePoses()});
  EXPECT_TRUE(contains(errorOf([&] {
                         while (refusion.step(size_t{1} << 30)) {
                         }
                       }),
                       "map/max_memory_mb"));
  EXPECT_TRUE(contains(whyTooLarge(200, 200, 300), "map/max_memory_mb"));
}

TEST_F(CorrectedJournal, IsUnchangedIfACorrectionIsRefused) {
  std::vector<StampedPose> poses = truePoses();
  for (StampedPose& pose : poses) {
    pose.T_W_C = Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX()) * pose.T_W_C;
  }
  JournalReplay replay(journal_.path());
  const std::string turned = errorOf([&] { replay.correctGiven(poses); });
  EXPECT_TRUE(contains(turned, "from 0.000 s to 0.700 s, all 8 corrected poses") &&
              contains(turned, "not in the map's frame"))
      << turned;
  EXPECT_TRUE(mapOf(replay, journaledParams()) == fileOf(map_.mapper()));
}

// Once a SLAM system has adopted the correction, its poses are used unchanged.
TEST_F(JournalOfALap, MovesLaterPosesUntilTheSourceJumps) {
  for (int i = 0; i < kCount; ++i) fuse(i, drift(11));
  Refusion refusion = refusionOf(truePoses());
  for (int i = kCount; i < kCount + 3; ++i) fuse(i, drift(11));
  refusion.step(0);
  for (int i = kCount + 3; i < 2 * kCount; ++i) fuse(i, Eigen::Isometry3d::Identity());
  const std::string corrected = finish(refusion);
  EXPECT_TRUE(refusion.replay().motion().isApprox(Eigen::Isometry3d::Identity()));
  const std::vector<StampedPose> now = refusion.replay().firstCamera();
  ASSERT_EQ(now.size(), size_t{2 * kCount});
  for (int i = 0; i < 2 * kCount; ++i) {
    EXPECT_LT((now[static_cast<size_t>(i)].T_W_C.matrix() - truePose(i).matrix()).norm(), 1e-12);
  }
  journal_.add(refusion.correction());
  ASSERT_TRUE(journal_.written().get());
  EXPECT_TRUE(mapOf(journal_.path(), journaledParams()) == corrected);
}

// Odometry never adopts a correction, so all subsequent poses are corrected.
TEST_F(JournalOfALap, MovesAllLaterPosesWithoutAJump) {
  for (int i = 0; i < kCount; ++i) fuse(i, drift(11));
  Refusion refusion = refusionOf(truePoses());
  for (int i = kCount; i < 2 * kCount; ++i) fuse(i, drift(11));
  finish(refusion);
  EXPECT_TRUE(refusion.replay().motion().isApprox(drift(11).inverse(), 1e-9));
  EXPECT_TRUE(
      refusion.replay().firstCamera().back().T_W_C.isApprox(truePose(2 * kCount - 1), 1e-9));
}

TEST_F(CorrectedJournal, CanBeCorrectedTwice) {
  std::vector<StampedPose> halfway = truePoses();
  for (int i = 0; i < kCount; ++i) {
    StampedPose& pose = halfway[static_cast<size_t>(i)];
    pose.T_W_C = drift(i / 2) * pose.T_W_C;
  }
  Refusion first = refusionOf(halfway);
  journal_.add(first.correction());
  // The second path corrects images 0 to 4 and leaves all images from 5 on unchanged.
  std::vector<StampedPose> rest = truePoses(5);
  rest.push_back(halfway[5]);
  Refusion second = refusionOf(rest);
  const auto expected = makeMapper(journaledParams());
  for (int i = 0; i < kCount; ++i) {
    expected->integrate(
        withPose(image(i), i < 5 ? truePose(i) : halfway[static_cast<size_t>(i)].T_W_C).view());
  }
  EXPECT_TRUE(finish(second) == fileOf(*expected));
}

// If a recording is played twice, each stamp occurs twice. Only the second pass is corrected.
TEST_F(JournalOfALap, CorrectsOnlyTheLatestPass) {
  for (int i = 0; i < kCount; ++i) fuse(i, Eigen::Isometry3d::Identity());
  for (int i = 0; i < kCount; ++i) fuse(i, drift(20));
  Refusion refusion = refusionOf(truePoses());
  EXPECT_EQ(refusion.effect().moved, size_t{kCount});
  const auto twice = makeMapper(journaledParams());
  for (int i = 0; i < 2 * kCount; ++i) twice->integrate(image(i % kCount).view());
  EXPECT_TRUE(finish(refusion) == fileOf(*twice));
}

// Blocks far from a point that moves with the camera are dropped.
TEST(CorrectedJournalWithKeepRadius, DropsBlocksFarFromCorrectedPoses) {
  const TemporaryFolder folder;
  MapperParams near = journaledParams();
  near.fusion.max_depth_m = near.map.keep_radius_m = 1.5f;
  JournalWriter journal(journalOptions(folder.path()));
  JournaledMap map(near, journal);
  const auto expected = makeMapper(near);
  std::vector<StampedPose> poses;
  const std::vector<SceneFrame> images = roomImages(24);
  for (int i = 0; i < 24; ++i) {
    const SceneFrame& image = images[static_cast<size_t>(i)];
    const auto at = [&](const Eigen::Isometry3d& T_W_C) {
      SceneFrame moved = withPose(image, T_W_C);
      moved.frame.keep_center_W = T_W_C * Eigen::Vector3d(0.1, 0.0, -0.2);
      return moved;
    };
    map.fuse(at(drift(i) * image.frame.T_W_C), 0.1 * i);
    expected->integrate(at(image.frame.T_W_C).view());
    poses.push_back({0.1 * i, image.frame.T_W_C});
  }
  ASSERT_GT(expected->stats().dropped_blocks, 0u);
  ASSERT_TRUE(journal.written().get());
  JournalReplay replay(journal.path());
  replay.correctGiven(poses);
  EXPECT_TRUE(mapOf(replay, near) == fileOf(*expected));
}

/// correctGiven() applies the journal's levelling transform to the corrected poses, so the map
/// stays level. correct() expects poses that are already levelled.
TEST(LevelledJournal, StaysLevel) {
  const TemporaryFolder folder;
  JournalWriter journal(journalOptions(folder.path()));
  const Eigen::Isometry3d T_W_M =
      Eigen::Translation3d(0.0, 0.0, 1.0) * Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitX());
  JournaledMap map(journaledParams(), journal);
  journal.add(journal::Level{T_W_M});
  std::vector<StampedPose> given;
  for (const SceneFrame& frame : roomImages(4)) {
    const double stamp_s = 0.1 * static_cast<double>(given.size());
    map.fuse(frame, stamp_s);
    given.push_back({stamp_s, T_W_M.inverse() * frame.frame.T_W_C});
  }
  ASSERT_TRUE(journal.written().get());
  JournalReplay replay(journal.path());
  EXPECT_EQ(replay.correctGiven(given).moved, 0u)
      << "poses that differ only by rounding should not be corrected";
  EXPECT_TRUE(mapOf(replay, journaledParams()) == fileOf(map.mapper()));
  JournalReplay tipped(journal.path());
  EXPECT_TRUE(contains(errorOf([&] {
                         tipped.correct({tipped.count(), given});
                       }),
                       "more than 1 radian"));
}

}  // namespace
}  // namespace dtsdf
