// A corrected map is the map of the corrected poses, byte for byte.
#include "log/refusion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "dtsdf_mapping/mesh.h"
#include "kernels/core/grid.h"
#include "support/logged_map.h"

namespace dtsdf {
namespace {

constexpr size_t kNothing = 0;

MapperParams params() {
  MapperParams params = makeCpuParams();
  params.map.voxel_size_m = 0.05f;
  params.map.max_memory_mb = 256;
  params.sensor.kind = Sensor::kTimeOfFlight;
  return params;
}

/// By which a lap's images were off: nothing at first, then more and more sideways.
Eigen::Isometry3d drift(int i) {
  Eigen::Isometry3d T(Eigen::AngleAxisd(0.002 * i, Eigen::Vector3d::UnitZ()));
  T.translation() = Eigen::Vector3d(0.0, 0.01 * i, 0.0);
  return T;
}

/// As a file with the poses of some images would say it.
LogCorrection correctionTo(const std::vector<Eigen::Isometry3d>& T_W_C, int step, uint64_t before) {
  LogCorrection correction;
  correction.before = before;
  for (size_t i = 0; i < T_W_C.size(); i += static_cast<size_t>(step)) {
    correction.poses.push_back({static_cast<double>(i) / 10.0, T_W_C[i]});
  }
  return correction;
}

PaintedFrame roomColour(const Eigen::Isometry3d& T_W_C, int brightness) {
  return renderColour(
      makeRoomScene(),
      [brightness](const Eigen::Vector3d& p_W) -> Colour {
        const int stripe = static_cast<int>(std::floor(4.0 * (p_W.x() + p_W.y() + p_W.z())));
        const auto level = static_cast<uint8_t>(brightness + 60 * (stripe & 1));
        return {level, static_cast<uint8_t>(level / 2), 90};
      },
      T_W_C, 80, 60);
}

/// As a sensor sees it: noise that is estimated from each image and widens the reach of its
/// surfels, and pixels without a measurement.
std::vector<SceneFrame> withNoise(std::vector<SceneFrame> images) {
  std::mt19937 random(5);
  std::normal_distribution<float> error_m(0.0f, 0.04f);
  for (SceneFrame& image : images) {
    for (float& z : image.depth_m) z = random() % 40 == 0 ? 0.0f : z + error_m(random);
  }
  return images;
}

/// A map that nothing is logged of.
struct Plain {
  std::unique_ptr<Mapper> mapper = makeMapper(params());

  void fuse(const SceneFrame& frame, double) { mapper->integrate(frame.view()); }
  void paint(const PaintedFrame& frame, double) { mapper->paint(frame.view()); }
  void clearRegion(const Region& region) { mapper->clearRegion(region); }
};

/// Drifting images with noise, colours, and regions that are emptied, logged beside a map.
class CorrectedMap : public testing::Test {
 protected:
  static constexpr int kCount = 24;

  CorrectedMap() : images_(withNoise(roomImages(kCount))), log_(logOptions(folder_.path())) {}

  Eigen::Isometry3d truePose(int i) const { return images_[static_cast<size_t>(i)].frame.T_W_C; }
  std::vector<Eigen::Isometry3d> truePoses(int count = kCount) const {
    std::vector<Eigen::Isometry3d> poses;
    for (int i = 0; i < count; ++i) poses.push_back(truePose(i));
    return poses;
  }

  /// Image i at a pose, its colour image, and a region emptied after some.
  template <class Map>
  void take(Map& map, int i, const Eigen::Isometry3d& T_W_C) {
    map.fuse(movedTo(images_[static_cast<size_t>(i)], T_W_C), 0.1 * i);
    if (i % 4 == 0) {
      PaintedFrame colour = roomColour(truePose(i), 60 + 5 * i);
      colour.frame.T_W_C = T_W_C;
      map.paint(colour, 0.1 * i);
    }
    if (i == 13) map.clearRegion(SphereRegion{Eigen::Vector3d(1.0, 0.5, 0.5), 0.8});
  }

  Refusion refusionOf(const LogCorrection& correction) {
    Refusion refusion(folder_.path(), params());
    effect_ = refusion.effectOf(correction);
    refusion.correct(correction);
    refusion.begin();
    return refusion;
  }

  static void finish(Refusion& refusion, size_t live_bytes = kNothing) {
    while (refusion.step(live_bytes)) {
    }
  }

  /// The map of the same images and calls at these poses, made without any of what is tested.
  std::string mapOf(const std::vector<Eigen::Isometry3d>& T_W_C) {
    Plain plain;
    for (size_t i = 0; i < T_W_C.size(); ++i) take(plain, static_cast<int>(i), T_W_C[i]);
    return fileOf(*plain.mapper);
  }

  /// What the log leads to by itself.
  std::string replayed() const {
    LogReplay replay(folder_.path());
    const std::unique_ptr<Mapper> again = makeMapper(params());
    while (const auto call = replay.next()) apply(*call, *again);
    return fileOf(*again);
  }

  TemporaryFolder folder_;
  std::vector<SceneFrame> images_;
  FrameLog log_;
  CorrectionEffect effect_;  ///< Of refusionOf().
};

TEST_F(CorrectedMap, AReplayIsTheMapThatWasLogged) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < kCount; ++i) take(live, i, drift(i) * truePose(i));
  LogReplay replay(folder_.path());
  EXPECT_EQ(readMapperParams(replay.settings()).sensor.kind, Sensor::kTimeOfFlight);
  const std::unique_ptr<Mapper> again = makeMapper(params());
  while (const auto call = replay.next()) apply(*call, *again);
  EXPECT_EQ(fileOf(*again), fileOf(live.mapper()));
}

TEST_F(CorrectedMap, CorrectedPosesGiveTheMapOfTheTruth) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < kCount; ++i) take(live, i, drift(i) * truePose(i));
  Refusion refusion = refusionOf(correctionTo(truePoses(), 1, log_.nextNumber()));
  EXPECT_EQ(effect_.moved, static_cast<size_t>(kCount - 1));  // the first one does not drift
  finish(refusion);
  EXPECT_EQ(refusion.fused(), static_cast<size_t>(kCount));
  MeshStore mesh(params().map.voxel_size_m), expected_mesh(params().map.voxel_size_m);
  MeshUpdate update;
  for (auto& [key, block] : refusion.takeMesh()) update.blocks.push_back(std::move(block));
  mesh.apply(std::move(update));
  const std::unique_ptr<Mapper> corrected = refusion.takeMapper();
  EXPECT_EQ(fileOf(*corrected), mapOf(truePoses()));
  EXPECT_NE(fileOf(*corrected), fileOf(live.mapper()));
  const std::array<float, 3> gains = corrected->contents().exposure;
  EXPECT_NE(gains, (std::array<float, 3>{1.0f, 1.0f, 1.0f})) << "each image goes by those before";
  EXPECT_NE(gains, live.mapper().contents().exposure) << "and by the poses";
}

// Images and calls that come while the second map is made are in it, as they came.
TEST_F(CorrectedMap, WhatComesMeanwhileIsCaughtUpWith) {
  LoggedMap live(params(), log_);
  int next = 0;
  for (; next < 12; ++next) take(live, next, drift(next) * truePose(next));
  const std::vector<Eigen::Isometry3d> poses = truePoses(12);
  Refusion refusion = refusionOf(correctionTo(poses, 1, log_.nextNumber()));
  for (; next < kCount; ++next) {
    refusion.step(kNothing);
    if (next == 20) live.checkpoint();  // the log goes on in another stretch
    take(live, next, truePose(next));   // the SLAM knows better by now
  }
  finish(refusion);
  EXPECT_EQ(refusion.nextNumber(), log_.nextNumber());
  EXPECT_EQ(fileOf(*refusion.takeMapper()), mapOf(truePoses()));
}

// Images after the last corrected pose keep their place relative to it, until the SLAM that gives
// their poses knows better, which its poses show.
TEST_F(CorrectedMap, WhatFollowsMovesWithItUntilTheSourceOfPosesJumps) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < 12; ++i) take(live, i, drift(11) * truePose(i));
  const LogCorrection correction = correctionTo(truePoses(12), 1, log_.nextNumber());
  Refusion refusion = refusionOf(correction);
  for (int i = 12; i < 15; ++i) take(live, i, drift(11) * truePose(i));
  refusion.step(kNothing);
  for (int i = 15; i < kCount; ++i) take(live, i, truePose(i));
  finish(refusion);
  EXPECT_TRUE(refusion.motion().isApprox(Eigen::Isometry3d::Identity()));
  const std::unique_ptr<Mapper> corrected = refusion.takeMapper();

  // The same by the rule of correct(), whose bits a truth in closed form has not.
  std::vector<StampedPose> fused;
  for (int i = 0; i < 12; ++i) fused.push_back({0.1 * i, drift(11) * truePose(i)});
  const PoseCorrection rule(correction.poses, fused);
  std::vector<Eigen::Isometry3d> poses = truePoses();
  for (int i = 12; i < 15; ++i) {
    poses[static_cast<size_t>(i)] = rule.correct(0.1 * i, drift(11) * truePose(i));
    EXPECT_LT((poses[static_cast<size_t>(i)].matrix() - truePose(i).matrix()).norm(), 1e-12);
  }
  EXPECT_EQ(fileOf(*corrected), mapOf(poses));

  // A log that holds the correction leads to the same map.
  log_.add(toRecord(refusion.corrections()[0]), refusion.corrections()[0]);
  EXPECT_EQ(replayed(), fileOf(*corrected));
}

// Odometry never jumps: what it gives is moved for good, in the log as well as by motion().
TEST_F(CorrectedMap, WhatFollowsMovesWithItForGoodIfTheSourceDoesNotJump) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < 12; ++i) take(live, i, drift(11) * truePose(i));
  Refusion refusion = refusionOf(correctionTo(truePoses(12), 1, log_.nextNumber()));
  for (int i = 12; i < kCount; ++i) take(live, i, drift(11) * truePose(i));
  finish(refusion);
  EXPECT_TRUE(refusion.motion().isApprox(drift(11).inverse(), 1e-9));
  const LoggedPoses::Item newest = [&] {
    LogReplay replay(folder_.path());
    replay.correct(refusion.corrections()[0]);
    return replay.poses().items().back();
  }();
  EXPECT_TRUE(newest.T_W_C.isApprox(truePose(kCount - 1), 1e-9));
}

// One that moves only what was not fused again yet goes on; one that comes too late starts over.
TEST_F(CorrectedMap, ASecondOneMayComeWhileTheFirstIsUnderWay) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < kCount; ++i) take(live, i, drift(i) * truePose(i));
  std::vector<Eigen::Isometry3d> halfway;
  for (int i = 0; i < kCount; ++i) halfway.push_back(drift(i / 2) * truePose(i));
  std::vector<Eigen::Isometry3d> later = halfway;
  for (int i = 16; i < kCount; ++i) later[static_cast<size_t>(i)] = truePose(i);
  const uint64_t end = log_.nextNumber();

  Refusion goes_on = refusionOf(correctionTo(halfway, 1, end));
  while (goes_on.fused() < 10) goes_on.step(kNothing);
  EXPECT_FALSE(goes_on.isTooLateFor(goes_on.effectOf(correctionTo(later, 1, end))));
  goes_on.correct(correctionTo(later, 1, end));
  EXPECT_EQ(goes_on.fused(), 10u);
  finish(goes_on);
  EXPECT_EQ(fileOf(*goes_on.takeMapper()), mapOf(later));

  Refusion starts_over = refusionOf(correctionTo(halfway, 1, end));
  while (starts_over.fused() < 20) starts_over.step(kNothing);
  EXPECT_TRUE(starts_over.isTooLateFor(starts_over.effectOf(correctionTo(later, 1, end))));
  starts_over.correct(correctionTo(later, 1, end));
  EXPECT_TRUE(starts_over.hasToBegin());
  starts_over.begin();
  EXPECT_EQ(starts_over.fused(), 0u);
  finish(starts_over);
  ASSERT_EQ(starts_over.corrections().size(), 2u);
  for (const LogCorrection& correction : starts_over.corrections()) {
    log_.add(toRecord(correction), correction);
  }
  EXPECT_EQ(replayed(), mapOf(later));
  EXPECT_EQ(fileOf(*starts_over.takeMapper()), mapOf(later));
}

// What has led to a map in the log is not fused again, unless it moves.
TEST_F(CorrectedMap, BeginsWithTheNewestMapBeforeWhatMoves) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < kCount; ++i) {
    if (i == 8 || i == 16) live.checkpoint();
    take(live, i, drift(i) * truePose(i));
  }
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < kCount; ++i) {
    poses.push_back(i < 18 ? drift(i) * truePose(i) : Eigen::Isometry3d(truePose(i)));
  }
  const uint64_t end = log_.nextNumber();
  Refusion late = refusionOf(correctionTo(poses, 1, end));
  EXPECT_EQ(late.total(), static_cast<size_t>(kCount - 16));
  finish(late);
  EXPECT_EQ(late.fused(), static_cast<size_t>(kCount - 16));
  const std::map<PackedKey, BlockMesh> mesh = late.takeMesh();
  const std::unique_ptr<Mapper> corrected = late.takeMapper();
  EXPECT_EQ(fileOf(*corrected), mapOf(poses));
  size_t blocks = 0;
  for (const BlockMesh& block : makeMapper(params(), corrected->contents())->updateMesh().blocks) {
    if (block.triangles.empty()) continue;
    ++blocks;
    ASSERT_EQ(mesh.count(packKey(block.key)), 1u) << "also of blocks that nothing has touched";
    EXPECT_EQ(mesh.at(packKey(block.key)).triangles.size(), block.triangles.size());
  }
  EXPECT_EQ(mesh.size(), blocks);

  // One that joins and reaches back further begins further back.
  poses[10] = truePose(10);
  Refusion joined = refusionOf(correctionTo(poses, 1, end));
  EXPECT_EQ(joined.total(), static_cast<size_t>(kCount - 8));
  finish(joined);
  EXPECT_EQ(fileOf(*joined.takeMapper()), mapOf(poses));
  Refusion all = refusionOf(correctionTo(truePoses(), 1, end));
  EXPECT_EQ(all.total(), static_cast<size_t>(kCount));
  finish(all);
  EXPECT_EQ(fileOf(*all.takeMapper()), mapOf(truePoses()));

  // Once the log says that image 10 has moved, the map before image 16 is no longer one to begin
  // with.
  log_.add(toRecord(joined.corrections()[0]), joined.corrections()[0]);
  poses[20].translation().x() += 0.05;
  Refusion later = refusionOf(correctionTo(poses, 1, log_.nextNumber()));
  EXPECT_EQ(later.total(), static_cast<size_t>(kCount - 8));
  finish(later);
  EXPECT_EQ(fileOf(*later.takeMapper()), mapOf(poses));
}

/// Whoever reads along may look just when a map has been written, and nothing after it.
TEST_F(CorrectedMap, BeginsWithAMapThatWasReadBeforeWhatFollowsIt) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < 4; ++i) take(live, i, truePose(i));
  live.checkpoint();
  LogReplay replay(folder_.path());
  for (int i = 4; i < 6; ++i) take(live, i, truePose(i));
  live.checkpoint();
  EXPECT_TRUE(replay.readOn());
  for (int i = 6; i < 9; ++i) take(live, i, truePose(i));
  EXPECT_TRUE(replay.readOn());
  const uint64_t end = log_.nextNumber();
  const std::string newest = replay.startOver(end);
  EXPECT_EQ(newest, LogReplay(folder_.path()).startOver(end));
  EXPECT_NE(newest, "");
  size_t calls = 0;
  while (replay.next()) ++calls;
  EXPECT_EQ(calls, 4u) << "three depth images and one with colours";
}

// The second one is of poses as the first one left them.
TEST_F(CorrectedMap, CorrectionsFollowEachOther) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < kCount; ++i) take(live, i, drift(i) * truePose(i));
  std::vector<Eigen::Isometry3d> halfway;
  for (int i = 0; i < kCount; ++i) halfway.push_back(drift(i / 2) * truePose(i));
  Refusion first = refusionOf(correctionTo(halfway, 1, log_.nextNumber()));
  log_.add(toRecord(first.corrections()[0]), first.corrections()[0]);
  // Of the images that the second one does not name, the first one's poses hold.
  LogCorrection rest = correctionTo(truePoses(), 1, log_.nextNumber());
  rest.poses.resize(12);
  rest.poses.push_back({1.2, halfway[12]});
  Refusion second = refusionOf(rest);
  finish(second);
  std::vector<Eigen::Isometry3d> expected = halfway;
  for (int i = 0; i < 12; ++i) expected[static_cast<size_t>(i)] = truePose(i);
  EXPECT_EQ(fileOf(*second.takeMapper()), mapOf(expected));
}

// A recording that plays again has each stamp twice: the newest counts.
TEST_F(CorrectedMap, AfterStampsWentBackOnlyTheNewestAreCorrected) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < 8; ++i) take(live, i, truePose(i));
  for (int i = 0; i < 8; ++i) take(live, i, drift(20) * truePose(i));
  const std::vector<Eigen::Isometry3d> poses = truePoses(8);
  Refusion refusion = refusionOf(correctionTo(poses, 1, log_.nextNumber()));
  EXPECT_EQ(effect_.moved, 8u);
  finish(refusion);
  const std::unique_ptr<Mapper> twice = makeMapper(params());
  for (int pass = 0; pass < 2; ++pass) {
    for (int i = 0; i < 8; ++i) {
      twice->integrate(images_[static_cast<size_t>(i)].view());
      if (i % 4 == 0) twice->paint(roomColour(truePose(i), 60 + 5 * i).view());
    }
  }
  EXPECT_EQ(fileOf(*refusion.takeMapper()), fileOf(*twice));
}

// What is far from a place beside the camera is forgotten; that place moves with the camera.
TEST_F(CorrectedMap, ForgetsWhatIsFarFromWhereTheCameraWas) {
  MapperParams near = params();
  near.fusion.max_depth_m = near.map.keep_radius_m = 1.5f;
  const auto imageAt = [&](int i, const Eigen::Isometry3d& T_W_C) {
    SceneFrame image = movedTo(images_[static_cast<size_t>(i)], T_W_C);
    image.frame.keep_center_W = T_W_C * Eigen::Vector3d(0.1, 0.0, -0.2);
    return image;
  };
  LoggedMap live(near, log_);
  const std::unique_ptr<Mapper> expected = makeMapper(near);
  for (int i = 0; i < kCount; ++i) {
    live.fuse(imageAt(i, drift(i) * truePose(i)), 0.1 * i);
    expected->integrate(imageAt(i, truePose(i)).view());
  }
  ASSERT_GT(expected->stats().dropped_blocks, 0u);
  Refusion refusion = refusionOf(correctionTo(truePoses(), 1, log_.nextNumber()));
  finish(refusion);
  EXPECT_EQ(fileOf(*refusion.takeMapper()), fileOf(*expected));
}

// The images that a loaded map is of are in another log, if any: only those since move.
TEST_F(CorrectedMap, BeginsWithAMapThatWasLoaded) {
  const std::unique_ptr<Mapper> other = makeMapper(params());
  for (int i = 0; i < 4; ++i) other->integrate(images_[static_cast<size_t>(i)].view());
  const auto contents = std::make_shared<const MapContents>(other->contents());
  LoggedMap live(params(), log_);
  for (int i = 0; i < 8; ++i) take(live, i, drift(i) * truePose(i));
  live.load(contents);
  Plain expected{makeMapper(params(), *contents)};
  for (int i = 8; i < kCount; ++i) {
    take(live, i, drift(i) * truePose(i));
    take(expected, i, truePose(i));
  }
  Refusion refusion = refusionOf(correctionTo(truePoses(), 1, log_.nextNumber()));
  EXPECT_EQ(effect_.moved, static_cast<size_t>(kCount - 8));
  finish(refusion);
  EXPECT_EQ(fileOf(*refusion.takeMapper()), fileOf(*expected.mapper));
}

TEST_F(CorrectedMap, AMapThatDoesNotFitBesideTheOtherOneIsRefused) {
  LoggedMap live(params(), log_);
  for (int i = 0; i < kCount; ++i) take(live, i, drift(i) * truePose(i));
  MapStats stats = live.mapper().stats();
  EXPECT_EQ(whyTooLarge(stats), "");
  stats.max_map_bytes = 2 * stats.map_bytes - 1;
  EXPECT_NE(whyTooLarge(stats).find("map/max_memory_mb"), std::string::npos);
  // And while it is made, should it be larger than that one.
  Refusion refusion = refusionOf(correctionTo(truePoses(), 1, log_.nextNumber()));
  const size_t nearly_all = (size_t{256} << 20) - 1000;
  EXPECT_NE(errorOf([&] { finish(refusion, nearly_all); }).find("map/max_memory_mb"),
            std::string::npos);
}

/// A log that has lost its oldest images, behind a map that they led to.
class Bounded : public CorrectedMap {
 protected:
  Bounded() {
    LoggedMap live(params(), log_);
    for (int i = 0; i < 12; ++i) take(live, i, drift(i) * truePose(i));
    live.checkpoint();
    for (int i = 12; i < kCount; ++i) take(live, i, drift(i) * truePose(i));
    live_ = fileOf(live.mapper());
    removeStretch(stretchesIn(folder_.path()).front().path);
  }
  std::string live_;
};

TEST_F(Bounded, IsReplayedFromTheMapThatItBeginsWith) {
  LogReplay replay(folder_.path());
  EXPECT_TRUE(replay.log().hasLostImages());
  const std::unique_ptr<Mapper> again =
      makeMapper(params(), loadMap(replay.log().baseMap(), params()));
  while (const auto call = replay.next()) apply(*call, *again);
  EXPECT_EQ(fileOf(*again), live_);
}

TEST_F(Bounded, ACorrectionOfWhatItHasIsDone) {
  LogCorrection late = correctionTo(truePoses(), 1, log_.nextNumber());
  late.poses.erase(late.poses.begin(), late.poses.begin() + 14);
  late.poses.insert(late.poses.begin(), {1.2, drift(12) * truePose(12)});
  Refusion refusion = refusionOf(late);
  finish(refusion);
  EXPECT_EQ(effect_.moved, static_cast<size_t>(kCount - 13));
}

TEST_F(Bounded, ACorrectionThatReachesBackFurtherIsRefused) {
  const auto errorFor = [&](const LogCorrection& correction) {
    return errorOf([&] { refusionOf(correction); });
  };
  const LogCorrection all = correctionTo(truePoses(), 1, log_.nextNumber());
  EXPECT_NE(errorFor(all).find("reaches back"), std::string::npos) << errorFor(all);
  LogCorrection late = all;
  late.poses.erase(late.poses.begin(), late.poses.begin() + 14);
  EXPECT_NE(errorFor(late).find("moves the first image"), std::string::npos) << errorFor(late);
}

}  // namespace
}  // namespace dtsdf
