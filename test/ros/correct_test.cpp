// Tests that a corrected map is identical to a map fused at the corrected poses, regardless of what
// arrives during the correction and how the work is split into steps.
#include "ros/steps/correct.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "io/map_chunks.h"
#include "ros/common/status_fields.h"
#include "ros/steps/journal.h"
#include "ros/steps/space.h"
#include "ros/support/map_host.h"
#include "support/journaled_map.h"

namespace dtsdf {
namespace {

constexpr int kCount = 20, kBefore = 12;

NodeParams mapped() {
  NodeParams params;
  params.mapper = makeCpuParams();
  params.mapper.map.voxel_size_m = 0.05f;
  params.mapper.map.max_memory_mb = 256;
  params.mapper.space.enabled = true;
  return params;
}

NodeParams journaledIn(const std::string& folder) {
  NodeParams params = mapped();
  params.journal_folder = folder;
  return params;
}

/// Images of one lap through the room.
const std::vector<SceneFrame>& lap() {
  static const std::vector<SceneFrame> images = roomImages(kCount);
  return images;
}

using CubesByPlace = std::map<PackedKey, std::pair<SpaceCube::Mask, SpaceCube::Mask>>;

CubesByPlace byPlace(const std::vector<SpaceCube>& cubes) {
  CubesByPlace by_place;
  for (const SpaceCube& cube : cubes) {
    by_place[packKey(SpaceCube::cubeOf(cube.first))] = {cube.free, cube.surface};
  }
  return by_place;
}

/// Simulates a drifting camera and a SLAM system that corrects its poses.
class CorrectTest : public testing::Test {
 protected:
  CorrectTest() : CorrectTest(nullptr) {}
  /// If `mapper` is null, creates one.
  explicit CorrectTest(std::unique_ptr<Mapper> mapper)
      : host_(mapper ? std::move(mapper) : makeMapper(mapped().mapper),
              journaledIn(folder_ / "journal")) {
    auto journal = std::make_unique<JournalStep>(host_.host);
    journal_ = journal.get();
    auto correction = std::make_unique<CorrectStep>(host_.host, &journal_->writer());
    correction_ = correction.get();
    auto space = std::make_unique<SpaceStep>(host_.host);
    space_ = space.get();
    host_.steps.push_back(std::move(correction));
    host_.steps.push_back(std::move(journal));
    host_.steps.push_back(std::move(space));
  }
  ~CorrectTest() override { host_.steps.clear(); }

  static ros::Time stampOf(int i) { return ros::Time(100.0) + ros::Duration(0.1 * i); }
  /// Image `i`. The images repeat after one lap.
  const SceneFrame& image(int i) const { return images_[static_cast<size_t>(i % kCount)]; }
  Eigen::Isometry3d truth(int i) const { return image(i).frame.T_W_C; }
  Eigen::Isometry3d drifted(int i) const {
    return Eigen::Translation3d(0.0, 0.02 * i, 0.0) * truth(i);
  }

  void push(int i, const Eigen::Isometry3d& T_W_C) {
    PosedFrame frame;
    frame.stamp = stampOf(i);
    DepthFrame depth = image(i).view();
    depth.T_W_C = T_W_C;
    frame.image = depth;
    frame.frame_id = "camera";
    host_.push(0, std::move(frame));
  }

  /// Fuses the first kBefore images at drifted poses.
  void begin() {
    for (int i = 0; i < kBefore; ++i) push(i, drifted(i));
    work();
    follow();
  }

  /// Calls step() until this thread has nothing left to do.
  void work() {
    while (step() == std::chrono::milliseconds(0)) {
    }
  }

  std::chrono::milliseconds step() {
    host_.clock.advance(0.001);
    return host_.map.step();
  }

  /// Calls step() until `count` corrections have been answered.
  void workUntilAnswered(size_t count = 1) {
    for (int i = 0; i < 20000 && answers_.size() < count; ++i) {
      if (step() > std::chrono::milliseconds(0)) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
    ASSERT_GE(answers_.size(), count);
  }

  void correct(const std::vector<StampedPose>& poses, double least = 0.0) {
    correction_->add({{0, poses}, least, [this](const CorrectionResult& result) {
                        answers_.push_back(result);
                      }});
  }

  /// Ends the journal by adding an image that is too large to be written in time.
  void endJournal() {
    PosedFrame frame;
    DepthFrame depth = images_[0].view();
    depth.row_bytes = size_t{1} << 30;
    frame.image = depth;
    journal_->fused(frame, {});
  }

  size_t fusedAgain() {
    MapStatus status;
    correction_->fill(status);
    return status.correction_fused;
  }

  /// Calls step() until the correction has fused `count` images again.
  void workUntilFusedAgain(size_t count) {
    for (int i = 0; i < 5000 && fusedAgain() < count; ++i) {
      step();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_EQ(fusedAgain(), count);
  }

  std::vector<Eigen::Isometry3d> drift(int count) const {
    std::vector<Eigen::Isometry3d> poses;
    for (int i = 0; i < count; ++i) poses.push_back(drifted(i));
    return poses;
  }

  /// Poses of the images from index `from` on, with the drift scaled by `left`.
  std::vector<StampedPose> corrected(double left, int from = 0) const {
    std::vector<StampedPose> poses;
    for (int i = from; i < kBefore; ++i) {
      poses.push_back(
          {stampOf(i).toSec(), Eigen::Translation3d(0.0, 0.02 * left * i, 0.0) * truth(i)});
    }
    return poses;
  }

  /// Applies the queued mesh changes to mesh_ and publishes the free-space grid. Returns the number
  /// of changed blocks.
  size_t follow() {
    MeshChanges changes = host_.mesh_changes.take();
    if (!changes.stamp.isZero()) mesh_stamp_ = changes.stamp;
    apply(changes, mesh_);
    space_->publish(nullptr);
    return changes.blocks.size();
  }

  /// Checks that the map, mesh and free-space grid equal those built from the first images at the
  /// poses `T_W_C`.
  void expectMapOf(const std::vector<Eigen::Isometry3d>& T_W_C) {
    ASSERT_EQ(host_.map.flushMesh(), "");
    follow();
    const std::unique_ptr<Mapper> plain = makeMapper(host_.params.mapper);
    for (size_t i = 0; i < T_W_C.size(); ++i) {
      plain->integrate(withPose(image(static_cast<int>(i)), T_W_C[i]).view());
    }
    MeshStore expected(host_.params.mapper.map.voxel_size_m);
    expected.apply(plain->updateMesh());
    const MapContents now = contents();
    EXPECT_EQ(contentHash(now), contentHash(plain->contents()));
    EXPECT_EQ(mesh_.keys().size(), expected.blocks().size());
    for (const auto& [key, block] : expected.blocks()) EXPECT_FALSE(mesh_.put(block));
    const std::shared_ptr<const SpaceSnapshot> space = space_->known().space;
    constexpr int32_t kLowest = std::numeric_limits<int32_t>::min(),
                      kHighest = std::numeric_limits<int32_t>::max();
    EXPECT_EQ(byPlace(space->cubes(kLowest, kHighest)),
              byPlace(plain->space()->takeChanges().cubes));
  }

  std::vector<Eigen::Isometry3d> truths(int count) const {
    std::vector<Eigen::Isometry3d> poses;
    for (int i = 0; i < count; ++i) poses.push_back(truth(i));
    return poses;
  }

  MapContents contents() { return contentsWith(host_.map.origin(), host_.map.mapper()); }

  TemporaryFolder folder_;
  const std::vector<SceneFrame>& images_ = lap();
  std::vector<CorrectionResult> answers_;
  MapHost host_;
  JournalStep* journal_;
  CorrectStep* correction_;
  SpaceStep* space_;
  PagedMeshes mesh_{host_.params.mapper.map};
  ros::Time mesh_stamp_;
};

TEST_F(CorrectTest, MatchesAMapFusedAtCorrectedPoses) {
  begin();
  correct(corrected(0.0));
  workUntilAnswered();
  ASSERT_TRUE(answers_[0].success) << answers_[0].message;
  EXPECT_EQ(answers_[0].moved, static_cast<size_t>(kBefore - 1));
  EXPECT_EQ(answers_[0].fused, static_cast<size_t>(kBefore));
  mesh_stamp_ = ros::Time();
  follow();
  EXPECT_EQ(mesh_stamp_, stampOf(kBefore - 1));
  EXPECT_EQ(space_->known().stamp, stampOf(kBefore - 1));
  EXPECT_EQ(contents().stamp_s, stampOf(kBefore - 1).toSec());
  expectMapOf(truths(kBefore));
}

/// If only the last image moves, blocks outside its view are not sent again.
TEST_F(CorrectTest, ListenersGetOnlyChangedBlocks) {
  begin();
  ASSERT_EQ(host_.map.flushMesh(), "");
  follow();
  const size_t all = mesh_.keys().size();
  std::vector<StampedPose> last = corrected(1.0, kBefore - 2);
  last[1].T_W_C.translation().y() += 0.02;
  correct(last);
  workUntilAnswered();
  ASSERT_TRUE(answers_[0].success) << answers_[0].message;
  EXPECT_EQ(answers_[0].moved, 1u);
  const size_t changed = follow();
  EXPECT_GT(changed, 0u);
  EXPECT_LT(changed, all * 3 / 4);
}

/// A correction must end without losing frames even if the queue is never empty.
TEST_F(CorrectTest, EndsEvenIfFramesKeepArriving) {
  begin();
  int next = kBefore;
  push(next, truth(next));
  ++next;
  correct(corrected(0.0));
  while (answers_.empty() && next < 500) {
    for (; !host_.queue.hasTurn(); ++next) push(next, truth(next));
    step();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_EQ(answers_.size(), 1u);
  ASSERT_TRUE(answers_[0].success) << answers_[0].message;
  work();
  EXPECT_EQ(host_.depth.counts().fused, static_cast<uint64_t>(next));
  expectMapOf(truths(next));
}

/// Frames that arrive after a correction are corrected like the last corrected image, until their
/// poses jump.
TEST_F(CorrectTest, LaterFramesAreCorrectedUntilAJump) {
  begin();
  correct(corrected(0.0));
  workUntilAnswered();
  const Eigen::Translation3d off(0.0, 0.02 * (kBefore - 1), 0.0);
  for (int i = kBefore; i < 16; ++i) push(i, off * truth(i));
  for (int i = 16; i < kCount; ++i) push(i, truth(i));
  work();
  const MapContents now = contents();
  // Rounding errors in the poses make an exact comparison with the truth impossible, so the map is
  // compared with a replay of the journal.
  ASSERT_EQ(host_.map.flushMesh(), "");
  follow();
  ASSERT_TRUE(journal_->writer().written().get());
  JournalReplay replay(journal_->writer().path());
  ASSERT_EQ(replay.depthImages(), static_cast<size_t>(kCount));
  int i = 0;
  for (const StampedPose& pose : replay.firstCamera()) {
    EXPECT_LT((pose.T_W_C.matrix() - truth(i).matrix()).norm(), 1e-9) << i;
    ++i;
  }
  const std::unique_ptr<Mapper> again = makeMapper(host_.params.mapper);
  while (const auto call = replay.next()) repeatCall(*call, *again);
  EXPECT_EQ(contentHash(again->contents()), contentHash(now));
}

/// While a correction runs, only the newest request is kept. Older requests that have not started
/// are refused at once.
TEST_F(CorrectTest, OnlyTheNewestCorrectionWaits) {
  begin();
  correct(corrected(0.9));
  workUntilFusedAgain(3);
  for (int i = 0; i < 91; ++i) correct(corrected(0.5));
  correct(corrected(0.0));
  EXPECT_EQ(answers_.size(), 91u);
  for (const CorrectionResult& answer : answers_) {
    EXPECT_NE(answer.message.find("a newer correction"), std::string::npos) << answer.message;
  }
  workUntilAnswered(93);
  EXPECT_TRUE(answers_[91].success) << answers_[91].message;
  EXPECT_TRUE(answers_[92].success) << answers_[92].message;
  expectMapOf(truths(kBefore));
}

/// When the journal ends, even a running correction is refused, because the corrected map would
/// lack all frames fused after that. Clearing the map starts a new journal.
TEST_F(CorrectTest, IsRefusedOnceTheJournalHasEnded) {
  begin();
  correct(corrected(0.0));
  workUntilFusedAgain(3);
  endJournal();
  for (int i = kBefore; i < kCount; ++i) push(i, drifted(i));
  workUntilAnswered();
  work();
  correct(corrected(0.0));
  ASSERT_EQ(answers_.size(), 2u) << "the second correction should be refused at once";
  for (const CorrectionResult& answer : answers_) {
    EXPECT_FALSE(answer.success);
    EXPECT_NE(answer.message.find("too slow; nothing has been written since"), std::string::npos)
        << answer.message;
  }
  expectMapOf(drift(kCount));
  host_.map.clear();
  begin();
  correct(corrected(0.0));
  workUntilAnswered(3);
  EXPECT_TRUE(answers_[2].success) << answers_[2].message;
}

/// Requests the same correction again while it is running. The second request is answered when the
/// first correction ends.
TEST_F(CorrectTest, ARepeatedCorrectionMovesNothing) {
  begin();
  correct(corrected(0.0));
  workUntilFusedAgain(3);
  correct(corrected(0.0));
  EXPECT_TRUE(answers_.empty());
  workUntilAnswered(2);
  EXPECT_EQ(answers_[0].moved, static_cast<size_t>(kBefore - 1)) << answers_[0].message;
  EXPECT_TRUE(answers_[1].success);
  EXPECT_EQ(answers_[1].message, "nothing to correct: no pose changes");
  expectMapOf(truths(kBefore));
}

TEST_F(CorrectTest, SmallCorrectionsAreIgnored) {
  begin();
  std::vector<StampedPose> nearly = corrected(1.0);
  nearly[5].T_W_C.translation().x() += 0.004;
  correct(nearly, 0.01);
  workUntilAnswered();
  EXPECT_TRUE(answers_[0].success);
  EXPECT_EQ(answers_[0].moved, 0u) << answers_[0].message;
  correct(nearly);
  workUntilAnswered(2);
  EXPECT_EQ(answers_[1].moved, 1u) << answers_[1].message;
}

TEST_F(CorrectTest, EndsWhenTheMapIsCleared) {
  begin();
  correct(corrected(0.0));
  for (int i = 0; i < 3; ++i) step();
  host_.map.clear();
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_FALSE(answers_[0].success);
  EXPECT_NE(answers_[0].message.find("emptied"), std::string::npos);
  push(kBefore, truth(kBefore));
  work();
  EXPECT_EQ(host_.depth.counts().fused, static_cast<uint64_t>(kBefore + 1));
  // The cancelled correction must not affect the next one.
  correct({{stampOf(kBefore).toSec(), drifted(kBefore)}});
  workUntilAnswered(2);
  EXPECT_TRUE(answers_[1].success) << answers_[1].message;
  EXPECT_EQ(answers_[1].fused, 1u);
}

/// A map so large that a second copy would exceed the memory budget.
class CorrectionOfALargeMap : public CorrectTest {
 protected:
  CorrectionOfALargeMap() : CorrectTest(std::make_unique<FakeMapper>()) {}
};

TEST_F(CorrectionOfALargeMap, IsRefused) {
  begin();
  static_cast<FakeMapper&>(host_.map.mapper()).counts.map_bytes = FakeMapper::kBudgetBytes * 6 / 10;
  correct(corrected(0.0));
  ASSERT_EQ(answers_.size(), 1u);
  EXPECT_FALSE(answers_[0].success);
  EXPECT_NE(answers_[0].message.find("map/max_memory_mb"), std::string::npos);
}

/// If the journal turns out to be damaged, the correction is refused and the map stays unchanged.
TEST_F(CorrectTest, IsRefusedIfTheJournalIsDamaged) {
  begin();
  const std::string before = fileOf(*makeMapper(host_.params.mapper, contents()));
  ASSERT_TRUE(journal_->writer().written().get());
  const std::string path = journal_->writer().path();
  std::string bytes = readBytes(path);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  {
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  correct(corrected(0.0));
  workUntilAnswered();
  EXPECT_FALSE(answers_[0].success);
  EXPECT_NE(answers_[0].message.find("damaged"), std::string::npos) << answers_[0].message;
  EXPECT_EQ(fileOf(*makeMapper(host_.params.mapper, contents())), before);
  push(kBefore, drifted(kBefore));
  work();
  EXPECT_EQ(host_.depth.counts().fused, static_cast<uint64_t>(kBefore + 1));
}

}  // namespace
}  // namespace dtsdf
