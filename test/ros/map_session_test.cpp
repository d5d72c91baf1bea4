#include "ros/session/map_session.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>

#include "ros/support/fake_clock.h"
#include "ros/support/fake_mapper.h"

namespace dtsdf {
namespace {

/// What a file said of its map.
std::shared_ptr<const MapContents> mapOf(
    double stamp_s, const std::optional<Eigen::Isometry3d>& T_W_M = std::nullopt) {
  auto contents = std::make_shared<MapContents>();
  contents->stamp_s = stamp_s;
  contents->T_W_M = T_W_M;
  return contents;
}

class MapSessionTest : public testing::Test {
 protected:
  MapSessionTest() { frames_.addStream({}); }

  /// A frame that changes the block of this x.
  void pushFrame(int block_x = 0) {
    PosedFrame frame;
    frame.stamp = ros::Time(static_cast<double>(++frames_sent_));
    DepthFrame depth;
    depth.T_W_C.translation().x() = block_x;
    frame.image = depth;
    const ros::Time stamp = frame.stamp;
    EXPECT_TRUE(frames_.push(0, stamp, std::move(frame)));
  }

  /// A colour image with the stamp of the last frame.
  void pushColour() {
    PosedFrame frame;
    frame.stamp = ros::Time(static_cast<double>(frames_sent_));
    frame.image = ColourFrame{};
    frame.stream = 1;
    const ros::Time stamp = frame.stamp;
    EXPECT_TRUE(frames_.push(0, stamp, std::move(frame)));
  }

  /// Until there is nothing left to do.
  void work() {
    while (session_.step() == std::chrono::milliseconds(0)) {
    }
  }

  uint64_t dropped() const {
    return accounting_.counts().dropped[static_cast<size_t>(DropReason::kBackendError)];
  }

  FakeClock clock_;
  bool mesh_wanted_ = true;
  int frames_sent_ = 0;
  FrameQueue frames_{0.1, [] {}, clock_.reader()};
  FrameLedger ledger_;
  FrameAccounting& accounting_ = ledger_.addStream(0);
  FrameAccounting& colour_accounting_ = ledger_.addStream(1);
  MeshHandover changes_{[] {}};
  FakeMapper* mapper_ = new FakeMapper;  ///< The session owns it.
  MapSession session_{std::unique_ptr<Mapper>(mapper_),
                      2.0,
                      {frames_, ledger_, changes_, [this] { return mesh_wanted_; }},
                      clock_.reader()};
};

/// A session whose space is handed over, and to whose mesh nobody listens.
class FollowedSessionTest : public MapSessionTest {
 protected:
  FollowedSessionTest() { mapper_of_space_->has_space = true; }

  void workFollowed() {
    while (followed_.step() == std::chrono::milliseconds(0)) {
    }
  }

  SpaceHandover space_{[] {}};
  FakeMapper* mapper_of_space_ = new FakeMapper;  ///< The session owns it.
  MapSession followed_{std::unique_ptr<Mapper>(mapper_of_space_),
                       0.01,
                       {frames_, ledger_, changes_, [] { return false; }, nullptr, &space_},
                       clock_.reader()};
};

/// Whoever asks for distances gets those of the last mesh: there is one at least twice a second.
TEST_F(FollowedSessionTest, SpaceIsHandedOverTwiceASecondWhileFramesCome) {
  for (int i = 0; i < 100; ++i) {
    pushFrame();
    workFollowed();
    clock_.advance(0.05);
    const bool is_due = i % 10 == 9;
    EXPECT_TRUE(!is_due || space_.take()) << i;
  }
  EXPECT_EQ(mapper_of_space_->meshes, 10);
  clock_.advance(10.0);
  workFollowed();
  EXPECT_EQ(space_.take()->stamp, ros::Time(100.0)) << "up to the last frame";
  EXPECT_EQ(mapper_of_space_->meshes, 11);
  clock_.advance(10.0);
  workFollowed();
  EXPECT_EQ(mapper_of_space_->meshes, 11) << "nothing has changed";
}

TEST_F(FollowedSessionTest, AFailureIsNoMapToRelyOn) {
  pushFrame();
  workFollowed();
  followed_.throwIfFailed();
  mapper_of_space_->fails_to_integrate = true;
  pushFrame();
  workFollowed();
  EXPECT_THROW(followed_.throwIfFailed(), std::runtime_error) << "though the mesh is whole";
  followed_.clear();
  followed_.throwIfFailed();
}

/// A mesh is finished after the next frame, whose surfaces it lacks.
TEST_F(FollowedSessionTest, SpaceHasTheStampOfTheMesh) {
  pushFrame();
  followed_.step();  // fuses
  followed_.step();  // begins the mesh
  pushFrame();
  workFollowed();
  EXPECT_EQ(mapper_of_space_->frames, 2);
  EXPECT_EQ(space_.take()->stamp, ros::Time(1.0));
  followed_.clear();
  EXPECT_TRUE(space_.take()->changes.begins_anew) << "before the session has another turn";
}

/// As of a large map that was loaded: the rest comes once the output has taken what there is.
TEST_F(FollowedSessionTest, MuchOfSpaceIsHandedOverInParts) {
  mapper_of_space_->known_space.parts_left = FakeSpace::kParts;
  pushFrame();
  for (int part = 1; part <= FakeSpace::kParts; ++part) {
    for (int i = 0; i < 3; ++i) workFollowed();
    EXPECT_EQ(mapper_of_space_->known_space.parts_left, FakeSpace::kParts - part);
    const auto delivery = space_.take();
    ASSERT_TRUE(delivery);
    EXPECT_EQ(delivery->changes.begins_anew, part == 1);
    EXPECT_EQ(delivery->changes.cubes.size(), static_cast<size_t>(FakeSpace::kCubesOfPart));
    EXPECT_EQ(delivery->stamp, part == FakeSpace::kParts ? ros::Time(1.0) : ros::Time());
  }
  workFollowed();
  EXPECT_FALSE(space_.take());
}

TEST_F(MapSessionTest, ClearingARegionOutdatesTheMesh) {
  pushFrame();
  work();
  EXPECT_FALSE(changes_.take().blocks.empty());
  EXPECT_EQ(session_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}).voxels, 1u);
  EXPECT_EQ(mapper_->cleared_regions, 1);
  clock_.advance(1.0);
  const int meshes = mapper_->meshes;
  work();
  EXPECT_EQ(mapper_->meshes, meshes + 1);
}

TEST_F(MapSessionTest, ARegionWithAProblemIsNoFailureOfTheBackend) {
  EXPECT_THROW(session_.clearRegion(SphereRegion{{0, 0, 0}, -1.0}), std::runtime_error);
  EXPECT_TRUE(session_.report().failure.empty());
  EXPECT_EQ(mapper_->cleared_regions, 0);
}

TEST_F(MapSessionTest, GoesOnWhereARegionIsClearedInPart) {
  pushFrame();
  work();
  mapper_->clears_in_part = true;
  EXPECT_THROW(session_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}), PartlyCleared);
  EXPECT_TRUE(session_.report().failure.empty());
  clock_.advance(1.0);
  const int meshes = mapper_->meshes;
  work();
  EXPECT_EQ(mapper_->meshes, meshes + 1) << "what could be cleared has gone from the mesh";
  pushFrame();
  work();
  EXPECT_EQ(mapper_->frames, 2) << "mapping goes on";
}

TEST_F(MapSessionTest, NothingIsClearedAfterAFailure) {
  mapper_->fails_to_clear = true;
  EXPECT_THROW(session_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}), std::runtime_error);
  EXPECT_FALSE(session_.report().failure.empty());
  mapper_->fails_to_clear = false;
  EXPECT_THROW(session_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}), std::runtime_error);
  EXPECT_EQ(mapper_->cleared_regions, 0);
  session_.clear();
  EXPECT_EQ(session_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}).blocks, 1u);
}

TEST_F(MapSessionTest, ReportsTheBudgetFromTheStart) {
  EXPECT_EQ(session_.report().stats.max_map_bytes, size_t{FakeMapper::kBudgetBytes});
}

TEST_F(MapSessionTest, FusesInOrderAndHandsTheMeshOver) {
  for (int i = 0; i < 3; ++i) pushFrame(i);
  work();
  EXPECT_EQ(mapper_->frames, 3);
  EXPECT_EQ(accounting_.counts().fused, 3u);
  EXPECT_EQ(accounting_.counts().last_fused_stamp, ros::Time(3.0));
  EXPECT_EQ(session_.report().stats.blocks, 3u) << "the counts are asked for when idle";
  EXPECT_EQ(session_.report().memory.scratch, 300u);

  clock_.advance(1.0);
  work();
  const MeshChanges changes = changes_.take();
  EXPECT_EQ(changes.blocks.size(), 3u);
  EXPECT_EQ(changes.stamp, ros::Time(3.0));
}

TEST_F(MapSessionTest, NothingIsMeshedForNobody) {
  mesh_wanted_ = false;
  pushFrame();
  work();
  clock_.advance(10.0);
  work();
  EXPECT_TRUE(changes_.take().blocks.empty());
  session_.bringMeshUpToDate();
  EXPECT_EQ(changes_.take().blocks.size(), 1u) << "but to save it";
}

/// The rest comes when the mesh is due again, or at once where it is saved.
TEST_F(MapSessionTest, MeshesInPartsUntilNothingIsLeft) {
  mapper_->parts_left = 2;
  pushFrame();
  for (int i = 0; i < 3; ++i) {
    work();
    EXPECT_EQ(mapper_->meshes, i + 1);
    clock_.advance(1.0);
  }
  work();
  EXPECT_EQ(mapper_->meshes, 3);
  mapper_->parts_left = 1;
  mesh_wanted_ = false;
  pushFrame();
  work();
  EXPECT_TRUE(session_.bringMeshUpToDate().is_part);
  EXPECT_FALSE(session_.bringMeshUpToDate().is_part);
  EXPECT_EQ(mapper_->meshes, 5);
}

TEST_F(MapSessionTest, FusesWhileTheOutputStandsStill) {
  for (int i = 0; i < 1000; ++i) {
    pushFrame(i % 4);
    clock_.advance(1.0);  // the mesh is due after each frame
    work();
  }
  EXPECT_EQ(mapper_->frames, 1000);
  // Nobody has asked for the changes meanwhile: each block waits once, with its newest mesh.
  const MeshChanges changes = changes_.take();
  ASSERT_EQ(changes.blocks.size(), 4u);
  for (const SharedBlockMesh& block : changes.blocks) {
    EXPECT_EQ(block->vertices[0].edge, 997u + static_cast<uint32_t>(block->key.x));
  }
}

TEST_F(MapSessionTest, ClearStartsOverAfterAFailure) {
  pushFrame();
  work();
  mapper_->fails_to_integrate = true;
  pushFrame();
  work();
  EXPECT_EQ(session_.report().failure, "out of memory");
  EXPECT_EQ(dropped(), 1u);

  mapper_->fails_to_integrate = false;
  pushFrame();
  work();
  EXPECT_EQ(mapper_->frames, 1) << "a map that may lack a part of a frame is not added to";
  EXPECT_EQ(dropped(), 2u);

  session_.clear();
  EXPECT_EQ(session_.report().failure, "");
  EXPECT_EQ(session_.report().stats.blocks, 0u);
  EXPECT_TRUE(changes_.take().cleared);
  pushFrame(5);
  clock_.advance(1.0);
  work();
  EXPECT_EQ(mapper_->frames, 1);
  EXPECT_EQ(dropped(), 2u);
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
}

TEST_F(MapSessionTest, AMapThatHasFailedCanStillBeSaved) {
  mesh_wanted_ = false;
  pushFrame();
  work();
  mapper_->fails_to_integrate = true;
  pushFrame();
  work();
  session_.bringMeshUpToDate();
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
}

TEST_F(MapSessionTest, AMeshThatWasLostIsThatOfBeforeUntilTheMapIsCleared) {
  mesh_wanted_ = false;
  pushFrame();
  work();
  EXPECT_EQ(session_.bringMeshUpToDate().problem, "");
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
  pushFrame(5);
  work();
  mapper_->fails_to_mesh = true;
  EXPECT_NE(session_.bringMeshUpToDate().problem.find("last extracted mesh: out of memory"),
            std::string::npos);
  EXPECT_EQ(session_.report().failure, "out of memory");
  mapper_->fails_to_mesh = false;
  EXPECT_NE(session_.bringMeshUpToDate().problem, "") << "what was lost would be a hole";
  EXPECT_TRUE(changes_.take().blocks.empty());
  session_.clear();
  EXPECT_EQ(session_.bringMeshUpToDate().problem, "");
}

TEST_F(MapSessionTest, ABackendThatCannotClearStaysFailed) {
  mapper_->fails_to_integrate = mapper_->fails_to_clear = true;
  pushFrame();
  work();
  EXPECT_THROW(session_.clear(), std::runtime_error);
  EXPECT_EQ(session_.report().failure, "out of memory");
}

TEST_F(MapSessionTest, ClearingForgetsAMeshUnderWay) {
  pushFrame();
  session_.step();  // fuses
  session_.step();  // begins the mesh
  session_.clear();
  work();
  const MeshChanges changes = changes_.take();
  EXPECT_TRUE(changes.cleared);
  EXPECT_TRUE(changes.blocks.empty());
}

TEST_F(MapSessionTest, GoesOnWithAMapThatWasLoaded) {
  pushFrame();
  work();
  EXPECT_FALSE(session_.isEmpty());
  auto* const loaded = new FakeMapper;
  loaded->frames = 7;
  const auto old =
      session_.replace({std::unique_ptr<Mapper>(loaded), 0.08f, "/a.dtsdf", mapOf(5.0)});
  EXPECT_EQ(old.get(), mapper_);
  EXPECT_EQ(session_.report().stats.blocks, 7u);
  EXPECT_EQ(session_.report().loaded_map, "/a.dtsdf");
  EXPECT_EQ(session_.contents().stamp_s, 5.0);
  const MeshChanges changes = changes_.take();
  EXPECT_TRUE(changes.cleared);
  EXPECT_EQ(changes.voxel_size_m, 0.08f);
  pushFrame(3);
  clock_.advance(1.0);
  work();
  EXPECT_EQ(loaded->frames, 8);
  EXPECT_EQ(session_.contents().stamp_s, 2.0) << "that of the frame";
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
  session_.clear();
  EXPECT_EQ(session_.report().loaded_map, "");
  EXPECT_TRUE(session_.isEmpty());
}

TEST_F(MapSessionTest, AMapThatIsLoadedStartsOverAfterAFailure) {
  mapper_->fails_to_integrate = true;
  pushFrame();
  work();
  mapper_->fails_to_count = true;
  EXPECT_FALSE(session_.isEmpty()) << "who knows what it holds";
  session_.replace({std::make_unique<FakeMapper>(), 0.05f, "/a.dtsdf", mapOf(0.0)});
  EXPECT_EQ(session_.report().failure, "");
  pushFrame();
  work();
  EXPECT_EQ(dropped(), 1u);
}

TEST_F(MapSessionTest, PaintsAndCountsColourForItself) {
  pushFrame();
  pushColour();
  work();
  EXPECT_EQ(mapper_->frames, 1);
  EXPECT_EQ(mapper_->images, 1);
  EXPECT_EQ(accounting_.counts().fused, 1u);
  EXPECT_EQ(colour_accounting_.counts().fused, 1u);
  clock_.advance(1.0);
  work();
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
  mapper_->fails_to_integrate = true;
  pushColour();
  work();
  EXPECT_EQ(dropped(), 0u);
  EXPECT_EQ(colour_accounting_.counts().dropped[static_cast<size_t>(DropReason::kBackendError)],
            1u);
}

/// A map that is to be level: frames wait for it, by being dropped, and then go into its frame.
TEST_F(MapSessionTest, FramesAreFusedInTheLevelFrame) {
  MappingParams params;
  params.node.level.from = LevelChoice::kImu;
  TransformBuffer transforms;
  const PoseSource poses(transforms, "map");
  Levelling levelling(params, poses, [](const Eigen::Isometry3d&) {});
  auto* const mapper = new FakeMapper;
  MapSession session(
      std::unique_ptr<Mapper>(mapper), 2.0,
      {frames_, ledger_, changes_, [] { return false; }, nullptr, nullptr, &levelling},
      clock_.reader());
  const auto workIt = [&] {
    while (session.step() == std::chrono::milliseconds(0)) {
    }
  };
  EXPECT_TRUE(session.isLevelled());
  EXPECT_FALSE(session_.isLevelled());
  pushFrame();
  workIt();
  EXPECT_EQ(mapper->frames, 0);
  EXPECT_EQ(accounting_.counts().dropped[static_cast<size_t>(DropReason::kNotLevel)], 1u);
  EXPECT_NE(accounting_.counts().last_drop.find("not level yet"), std::string::npos);
  EXPECT_FALSE(session.contents().T_W_M);

  Eigen::Isometry3d T_W_M = Eigen::Isometry3d::Identity();
  T_W_M.translation().x() = 5.0;
  auto* const loaded = new FakeMapper;
  session.replace({std::unique_ptr<Mapper>(loaded), 0.02f, "map.dtsdf", mapOf(0.0, T_W_M)});
  pushFrame(2);
  workIt();
  EXPECT_EQ(loaded->frames, 1);
  loaded->beginMeshUpdate();
  EXPECT_EQ(loaded->finishMeshUpdate().blocks.at(0).key.x, 7) << "where the pose was brought to";
  ASSERT_TRUE(session.contents().T_W_M);
  EXPECT_EQ(session.contents().T_W_M->matrix(), T_W_M.matrix());
  session.clear();
  EXPECT_TRUE(session.contents().T_W_M) << "the level stays";
}

}  // namespace
}  // namespace dtsdf
