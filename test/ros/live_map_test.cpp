#include "ros/steps/live_map.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>

#include "dtsdf_mapping/partly_cleared.h"
#include "ros/common/status_fields.h"
#include "ros/steps/level.h"
#include "ros/support/map_host.h"

namespace dtsdf {
namespace {

MapperParams voxelsOf(float size_m) {
  MapperParams params;
  params.map.voxel_size_m = size_m;
  return params;
}

/// The contents of a loaded map file.
MapContents mapOf(double stamp_s, const std::optional<Eigen::Isometry3d>& T_W_M = std::nullopt) {
  MapContents contents;
  contents.stamp_s = stamp_s;
  contents.T_W_M = T_W_M;
  return contents;
}

/// Requests the mesh at the given rate, or not at all if the rate is 0.
class MeshRequest : public Step {
 public:
  explicit MeshRequest(const double& rate_hz) : rate_hz_(rate_hz) {}
  std::optional<double> meshRate_hz() const override {
    return rate_hz_ > 0.0 ? std::optional<double>(rate_hz_) : std::nullopt;
  }

 private:
  const double& rate_hz_;
};

class LiveMapTest : public testing::Test {
 protected:
  LiveMapTest() {
    host_.steps.push_back(std::make_unique<MeshRequest>(mesh_rate_hz_));
    host_.steps.push_back(std::make_unique<LevelStep>(host_.params, host_.transforms, host_.frame));
  }

  /// Adds a frame that changes the block at block_x.
  void pushFrame(int block_x = 0) {
    PosedFrame frame;
    frame.stamp = ros::Time(static_cast<double>(++frames_sent_));
    DepthFrame depth;
    depth.T_W_C.translation().x() = block_x;
    frame.image = depth;
    host_.push(0, std::move(frame));
  }

  /// Adds a colour image with the stamp of the last frame.
  void pushColour() {
    PosedFrame frame;
    frame.stamp = ros::Time(static_cast<double>(frames_sent_));
    frame.image = ColourFrame{};
    host_.push(1, std::move(frame));
  }

  void work() { host_.work(); }

  uint64_t dropped(const DropReason& reason = drop::kBackendError) const {
    return host_.depth.counts().dropped_by[reason];
  }
  bool hasFailed() const { return host_.status().code == dtsdf_mapping::MapStatus::BACKEND_FAILED; }

  int frames_sent_ = 0;
  double mesh_rate_hz_ = 2.0;
  FakeMapper* mapper_ = new FakeMapper;  ///< Owned by the map.
  MapHost host_{std::unique_ptr<Mapper>(mapper_)};
  LiveMap& map_ = host_.map;
  MeshQueue& changes_ = host_.mesh_changes;
};

TEST_F(LiveMapTest, TheMeshIsExtractedAtTheRequestedRate) {
  for (int i = 0; i < 100; ++i) {
    pushFrame();
    work();
    host_.clock.advance(0.05);
  }
  EXPECT_EQ(mapper_->meshes, 10);
  host_.clock.advance(10.0);
  work();
  EXPECT_EQ(mapper_->meshes, 11);
  host_.clock.advance(10.0);
  work();
  EXPECT_EQ(mapper_->meshes, 11) << "an unchanged map should not be meshed";
}

/// After a slow mesh extraction, frames are fused for at least as long before the next one.
TEST_F(LiveMapTest, FramesGetAsMuchTimeAsMeshing) {
  mapper_->mesh_ms = 3000.0;
  for (int i = 0; i < 100; ++i) {
    pushFrame();
    work();
    host_.clock.advance(0.1);
  }
  EXPECT_LE(mapper_->meshes, 4);
}

TEST_F(LiveMapTest, ClearingARegionUpdatesTheMesh) {
  pushFrame();
  work();
  EXPECT_FALSE(changes_.take().blocks.empty());
  EXPECT_EQ(map_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}).voxels, 1u);
  EXPECT_EQ(mapper_->cleared_regions, 1);
  host_.clock.advance(1.0);
  const int meshes = mapper_->meshes;
  work();
  EXPECT_EQ(mapper_->meshes, meshes + 1);
}

TEST_F(LiveMapTest, MappingContinuesAfterAPartialClear) {
  pushFrame();
  work();
  mapper_->clears_in_part = mapper_->fails_to_count = true;
  EXPECT_THROW(map_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}), PartlyCleared);
  mapper_->fails_to_count = false;
  EXPECT_FALSE(hasFailed());
  host_.clock.advance(1.0);
  const int meshes = mapper_->meshes;
  work();
  EXPECT_EQ(mapper_->meshes, meshes + 1) << "the mesh should be updated after a partial clear";
  pushFrame();
  work();
  EXPECT_EQ(mapper_->frames, 2) << "mapping should continue";
}

TEST_F(LiveMapTest, NothingIsClearedAfterAFailure) {
  mapper_->fails_to_clear = true;
  EXPECT_THROW(map_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}), std::runtime_error);
  EXPECT_TRUE(hasFailed());
  mapper_->fails_to_clear = false;
  EXPECT_THROW(map_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}), std::runtime_error);
  EXPECT_EQ(mapper_->cleared_regions, 0);
  map_.clear();
  EXPECT_EQ(map_.clearRegion(SphereRegion{{0, 0, 0}, 1.0}).blocks, 1u);
}

TEST_F(LiveMapTest, ReportsTheBudgetFromTheStart) {
  EXPECT_EQ(host_.status().max_map_bytes, size_t{FakeMapper::kBudgetBytes});
}

TEST_F(LiveMapTest, FusesInOrderAndQueuesTheMesh) {
  for (int i = 0; i < 3; ++i) pushFrame(i);
  work();
  EXPECT_EQ(mapper_->frames, 3);
  EXPECT_EQ(host_.depth.counts().fused, 3u);
  EXPECT_EQ(host_.depth.counts().last_fused_stamp, ros::Time(3.0));
  EXPECT_EQ(host_.status().blocks, 3u);

  host_.clock.advance(1.0);
  work();
  const MeshChanges changes = changes_.take();
  EXPECT_EQ(changes.blocks.size(), 3u);
  EXPECT_EQ(changes.stamp, ros::Time(3.0));
}

/// A status update right after meshing would have to wait for blocks to be moved to disk. So the
/// update is postponed until a frame has been fused or no frame is ready.
TEST_F(LiveMapTest, AReadyFrameDelaysTheMeshReport) {
  pushFrame();
  map_.step();  // fuses
  map_.step();  // starts the mesh
  pushFrame();
  pushFrame();
  map_.step();  // fuses
  const int reports = mapper_->reports;
  map_.step();  // finishes the mesh
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
  EXPECT_EQ(mapper_->reports, reports);
  work();
  EXPECT_EQ(mapper_->reports, reports + 1) << "the status should be updated after the frame";
  map_.flushMesh();
  work();
  EXPECT_EQ(mapper_->reports, reports + 2) << "the status should be updated when idle";
}

TEST_F(LiveMapTest, NothingIsMeshedUnlessRequested) {
  mesh_rate_hz_ = 0.0;
  pushFrame();
  work();
  host_.clock.advance(10.0);
  work();
  EXPECT_TRUE(changes_.take().blocks.empty());
  map_.flushMesh();
  EXPECT_EQ(changes_.take().blocks.size(), 1u) << "flushMesh() should extract the mesh";
}

/// The next part of the mesh is extracted once the mesh is due again, or by the next flushMesh().
TEST_F(LiveMapTest, MeshesInPartsUntilNothingIsLeft) {
  mapper_->parts_left = 2;
  pushFrame();
  for (int i = 0; i < 3; ++i) {
    work();
    EXPECT_EQ(mapper_->meshes, i + 1);
    host_.clock.advance(1.0);
  }
  work();
  EXPECT_EQ(mapper_->meshes, 3);
  mapper_->parts_left = 1;
  mesh_rate_hz_ = 0.0;
  pushFrame();
  work();
  EXPECT_EQ(map_.flushMesh(), "");
  EXPECT_TRUE(map_.isMeshPart());
  EXPECT_EQ(map_.flushMesh(), "");
  EXPECT_FALSE(map_.isMeshPart());
  EXPECT_EQ(mapper_->meshes, 5);
}

TEST_F(LiveMapTest, FusesWhileTheOutputIsStalled) {
  for (int i = 0; i < 1000; ++i) {
    pushFrame(i % 4);
    host_.clock.advance(1.0);  // the mesh is due after each frame
    work();
  }
  EXPECT_EQ(mapper_->frames, 1000);
  // No changes were taken, so the queue contains each block only once, with its newest mesh.
  const MeshChanges changes = changes_.take();
  ASSERT_EQ(changes.blocks.size(), 4u);
  for (const auto& [key, block] : changes.blocks) {
    EXPECT_EQ(block->vertices[0].edge, 997u + static_cast<uint32_t>(block->key.x));
  }
}

TEST_F(LiveMapTest, ClearingRecoversFromAFailure) {
  pushFrame();
  work();
  mapper_->fails_to_integrate = true;
  pushFrame();
  work();
  EXPECT_EQ(host_.status().message, "the backend failed: out of memory");
  EXPECT_EQ(dropped(), 1u);

  mapper_->fails_to_integrate = false;
  pushFrame();
  work();
  EXPECT_EQ(mapper_->frames, 1) << "nothing should be fused after a partly fused frame";
  EXPECT_EQ(dropped(), 2u);

  map_.clear();
  EXPECT_FALSE(hasFailed());
  EXPECT_EQ(host_.status().blocks, 0u);
  EXPECT_TRUE(changes_.take().cleared);
  pushFrame(5);
  host_.clock.advance(1.0);
  work();
  EXPECT_EQ(mapper_->frames, 1);
  EXPECT_EQ(dropped(), 2u);
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
}

TEST_F(LiveMapTest, TheMeshCanBeSavedAfterAFailure) {
  mesh_rate_hz_ = 0.0;
  pushFrame();
  work();
  mapper_->fails_to_integrate = true;
  pushFrame();
  work();
  map_.flushMesh();
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
}

/// Until the map is cleared, the mesh remains as it was before the failure.
TEST_F(LiveMapTest, FailedMeshingKeepsTheLastMesh) {
  mesh_rate_hz_ = 0.0;
  pushFrame();
  work();
  EXPECT_EQ(map_.flushMesh(), "");
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
  pushFrame(5);
  work();
  mapper_->fails_to_mesh = true;
  EXPECT_NE(map_.flushMesh().find("last extracted mesh: out of memory"), std::string::npos);
  EXPECT_EQ(host_.status().message, "the backend failed: out of memory");
  mapper_->fails_to_mesh = false;
  EXPECT_NE(map_.flushMesh(), "") << "an incomplete mesh should not be saved without a warning";
  EXPECT_TRUE(changes_.take().blocks.empty());
  map_.clear();
  EXPECT_EQ(map_.flushMesh(), "");
}

TEST_F(LiveMapTest, ABackendThatCannotClearStaysFailed) {
  mapper_->fails_to_integrate = mapper_->fails_to_clear = true;
  pushFrame();
  work();
  EXPECT_THROW(map_.clear(), std::runtime_error);
  EXPECT_EQ(host_.status().message, "the backend failed: out of memory");
}

TEST_F(LiveMapTest, ClearingDiscardsAMeshInProgress) {
  pushFrame();
  map_.step();  // fuses
  map_.step();  // starts the mesh
  map_.clear();
  work();
  const MeshChanges changes = changes_.take();
  EXPECT_TRUE(changes.cleared);
  EXPECT_TRUE(changes.blocks.empty());
}

TEST_F(LiveMapTest, ACorrectionDoesNotNeedTheOldMesh) {
  pushFrame();
  map_.step();  // fuses
  map_.step();  // starts the mesh
  mapper_->fails_to_mesh = true;
  EXPECT_EQ(map_.replaceCorrected(std::make_unique<FakeMapper>(), {}).get(), mapper_);
  EXPECT_TRUE(changes_.take().is_whole);
  work();
  EXPECT_EQ(map_.flushMesh(), "");
}

TEST_F(LiveMapTest, MappingContinuesInALoadedMap) {
  pushFrame();
  work();
  EXPECT_FALSE(map_.isEmpty());
  auto* const loaded = new FakeMapper;
  loaded->frames = 7;
  const auto old =
      map_.replace(std::unique_ptr<Mapper>(loaded), voxelsOf(0.08f), "/a.dtsdf", mapOf(5.0));
  EXPECT_EQ(old.get(), mapper_);
  EXPECT_EQ(host_.status().blocks, 7u);
  EXPECT_EQ(host_.status().loaded_map, "/a.dtsdf");
  EXPECT_EQ(map_.origin().stamp_s, 5.0);
  const MeshChanges changes = changes_.take();
  EXPECT_TRUE(changes.cleared);
  EXPECT_EQ(changes.voxel_size_m, 0.08f);
  pushFrame(3);
  host_.clock.advance(1.0);
  work();
  EXPECT_EQ(loaded->frames, 8);
  EXPECT_EQ(map_.origin().stamp_s, 2.0) << "the map should have the stamp of its last frame";
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
  map_.clear();
  EXPECT_EQ(host_.status().loaded_map, "");
  EXPECT_TRUE(map_.isEmpty());
}

TEST_F(LiveMapTest, LoadingAMapRecoversFromAFailure) {
  mapper_->fails_to_integrate = true;
  pushFrame();
  work();
  mapper_->fails_to_count = true;
  EXPECT_FALSE(map_.isEmpty()) << "a map with unknown contents should not count as empty";
  map_.replace(std::make_unique<FakeMapper>(), voxelsOf(0.05f), "/a.dtsdf", mapOf(0.0));
  EXPECT_FALSE(hasFailed());
  pushFrame();
  work();
  EXPECT_EQ(dropped(), 1u);
}

TEST_F(LiveMapTest, ColourIsPaintedAndCountedSeparately) {
  pushFrame();
  pushColour();
  work();
  EXPECT_EQ(mapper_->frames, 1);
  EXPECT_EQ(mapper_->images, 1);
  EXPECT_EQ(host_.depth.counts().fused, 1u);
  EXPECT_EQ(host_.colour.counts().fused, 1u);
  host_.clock.advance(1.0);
  work();
  EXPECT_EQ(changes_.take().blocks.size(), 1u);
  mapper_->fails_to_integrate = true;
  pushColour();
  work();
  EXPECT_EQ(dropped(), 0u);
  EXPECT_EQ(host_.colour.counts().dropped_by[drop::kBackendError], 1u);
}

/// Frames are dropped until the map is levelled, and then fused in the levelled frame.
TEST(LevelMap, FramesAreFusedInTheLevelFrame) {
  NodeParams params;
  params.level = LevelChoice::kImu;
  MapHost host(std::make_unique<FakeMapper>(), params);
  host.steps.push_back(std::make_unique<LevelStep>(host.params, host.transforms, host.frame));
  const auto push = [&](double stamp_s) {
    PosedFrame frame;
    frame.stamp = ros::Time(stamp_s);
    DepthFrame depth;
    depth.T_W_C.translation().x() = 2.0;
    frame.image = depth;
    host.push(0, std::move(frame));
    host.work();
  };
  push(1.0);
  EXPECT_EQ(host.depth.counts().dropped_by[drop::kNotLevel], 1u);
  EXPECT_NE(host.depth.counts().last_drop.find("not levelled yet"), std::string::npos);
  EXPECT_TRUE(host.depth.counts().last_reason == drop::kNotLevel);
  EXPECT_FALSE(host.map.origin().T_W_M);

  Eigen::Isometry3d T_W_M = Eigen::Isometry3d::Identity();
  T_W_M.translation().x() = 5.0;
  auto* const loaded = new FakeMapper;
  host.map.replace(std::unique_ptr<Mapper>(loaded), {}, "map.dtsdf", mapOf(0.0, T_W_M));
  push(2.0);
  EXPECT_EQ(loaded->frames, 1);
  loaded->beginMeshUpdate();
  EXPECT_EQ(loaded->finishMeshUpdate().blocks.at(0).key.x, 7);
  ASSERT_TRUE(host.map.origin().T_W_M);
  EXPECT_EQ(host.map.origin().T_W_M->matrix(), T_W_M.matrix());
  host.map.clear();
  EXPECT_TRUE(host.map.origin().T_W_M) << "clearing should keep the levelling transform";
}

/// Example of a custom step. Rejects frames from one side of a plane and counts them in the status.
class HalfSpaceStep : public Step {
 public:
  std::optional<Rejection> place(PosedFrame& frame) override {
    const auto* const depth = std::get_if<DepthFrame>(&frame.image);
    if (depth == nullptr || depth->T_W_C.translation().x() >= 0.0) return std::nullopt;
    ++rejected_;
    return Rejection{drop::kBadPose, "it lies behind the plane"};
  }
  void fused(const PosedFrame&, const IntegrationResult&) override { ++fused_; }
  void meshed() override { ++meshes_; }
  void replaced(const MapContents*, const std::shared_ptr<const MapChunks>&) override {
    rejected_ = 0;
  }
  void fill(dtsdf_mapping::MapStatus& status) override {
    if (rejected_ == 0) return;
    report(status, dtsdf_mapping::MapStatus::WARN, dtsdf_mapping::MapStatus::SOME_DROPPED,
           std::to_string(rejected_) + " frames lie behind the plane");
  }

  int rejected_ = 0, fused_ = 0, meshes_ = 0;
};

TEST_F(LiveMapTest, AFeatureCanBeAddedAsAStep) {
  host_.steps.push_back(std::make_unique<HalfSpaceStep>());
  auto& step = static_cast<HalfSpaceStep&>(*host_.steps.back());
  pushFrame(1);
  pushFrame(-1);
  work();
  EXPECT_EQ(mapper_->frames, 1);
  EXPECT_EQ(dropped(drop::kBadPose), 1u);
  EXPECT_EQ(step.fused_, 1);
  EXPECT_EQ(step.meshes_, 1);
  dtsdf_mapping::MapStatus status;
  for (const auto& each : host_.steps) each->fill(status);
  EXPECT_EQ(status.code, dtsdf_mapping::MapStatus::SOME_DROPPED);
  map_.clear();
  EXPECT_EQ(step.rejected_, 0);
}

}  // namespace
}  // namespace dtsdf
