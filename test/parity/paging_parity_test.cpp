// On every backend, a map that pages to disk equals, bit for bit, the map of the CPU on one thread
// without paging.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "parity/backend_comparison.h"
#include "parity/test_frames.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

/// Settings, and operations besides fusing.
struct Way {
  FusionMode mode = FusionMode::kNormalRayCasting;
  bool directional = true;
  int budget_mb = 4;
  int mesh_every = 3;  ///< In frames; 0: once, at the end.
  bool painted = false, aligned = false, cleared = false, space = false, refined = false;
  bool turns = false;  ///< Alternates between rooms; see BlocksThatGoWithinAFrame.
  float keep_radius_m = 0.0f;
};

MapperParams paramsOf(const Way& way) {
  MapperParams params;
  params.fusion.mode = way.mode;
  params.map.directional = way.directional;
  params.map.voxel_size_m = 0.04f;
  params.map.keep_radius_m = way.keep_radius_m;
  params.fusion.max_depth_m = 4.0f;
  params.max_paint_depth_m = 2.0f;
  params.space.enabled = way.space;
  params.mesh.refine = way.refined ? 1 : 0;
  return params;
}

/// Three rooms, one after the other, and back.
const std::vector<int> kThreeRooms = {0, 1, 2, 1, 0};

/// `count` images of each room.
std::vector<std::pair<TestFrame, TestColours>> images(const std::vector<int>& rooms, int count) {
  std::vector<std::pair<TestFrame, TestColours>> all;
  for (const int room : rooms) {
    TestFrameSettings settings;
    settings.noise = true;
    settings.count = count;
    settings.offset_W = {6.0 * room, -3.0 * room, 0.0};
    const std::vector<TestFrame> frames = makeTestFrames(settings);
    const std::vector<TestColours> colours = makeTestColours(settings);
    for (size_t i = 0; i < frames.size(); ++i) all.emplace_back(frames[i], colours[i]);
  }
  return all;
}

/// A mapper on its way, and the mesh assembled from its updates.
class Traveller {
 public:
  Traveller(const Way& way, const MapperParams& params)
      : way_(way), mapper_(makeProbedMapper(params)), mesh_(params.map.voxel_size_m) {}

  void take(const TestFrame& frame, const TestColours& colours) {
    DepthFrame depth = frame.view();
    if (way_.aligned && count_ > 0) {
      depth.T_W_C.translate(Eigen::Vector3d(0.01, 0.0, 0.0));
      depth.T_W_C = mapper_->align(depth, PosePrior()).T_W_C;
    }
    ASSERT_EQ(mapper_->integrate(depth).status, FrameStatus::kFused);
    if (way_.painted) mapper_->paint(colours.view());
    ++count_;
    max_ = std::max(max_, mapper_->stats().map_bytes);
    if (way_.cleared && count_ == 9) {
      mapper_->clearRegion(SphereRegion{frame.frame.T_W_C.translation(), 7.0});
    }
    if (way_.mesh_every > 0 && count_ % way_.mesh_every == 0) updateMesh();
    if (way_.turns) meshWithoutSome();
  }
  /// Clears a part of the next room and begins a mesh update. The next image, which sees that part,
  /// arrives during the update.
  void meshWithoutSome() {
    if (count_ > 1) mesh_.apply(mapper_->finishMeshUpdate());
    mapper_->clearRegion(
        SphereRegion{Eigen::Vector3d(6.0 * (count_ % 2), -3.0 * (count_ % 2), 1.0), 1.0});
    mapper_->beginMeshUpdate();
  }
  void updateMesh() { mesh_.apply(mapper_->updateMesh()); }
  Mesh mesh() {
    if (way_.turns) mesh_.apply(mapper_->finishMeshUpdate());
    updateMesh();
    return mesh_.assemble();
  }
  ProbedMapper& mapper() { return *mapper_; }
  size_t most() const { return max_; }

 private:
  const Way way_;
  std::unique_ptr<ProbedMapper> mapper_;
  MeshStore mesh_;
  int count_ = 0;
  size_t max_ = 0;  ///< Bytes of the map.
};

class PagingParity : public testing::TestWithParam<Candidate> {
 protected:
  void SetUp() override {
    const std::string reason = reasonToSkip(GetParam());
    if (!reason.empty()) GTEST_SKIP() << reason;
  }

  void compare(const Way& way) {
    MapperParams params = paramsOf(way);
    params.backend = Backend::kCpu;
    params.threads = 1;
    Traveller whole(way, params);
    params.backend = GetParam() == Candidate::kCuda ? Backend::kCuda : Backend::kCpu;
    params.threads = GetParam() == Candidate::kCpuTwoThreads ? 2 : 1;
    params.map.max_memory_mb = way.budget_mb;
    params.map.page_folder = folder_.path();
    params.map.page_max_gb = 1.0f;
    Traveller paged(way, params);
    const auto all = way.turns ? images({2, 1, 0, 1, 0, 1, 0, 1}, 1) : images(kThreeRooms, 3);
    for (const auto& [frame, colours] : all) {
      ASSERT_NO_FATAL_FAILURE(whole.take(frame, colours));
      ASSERT_NO_FATAL_FAILURE(paged.take(frame, colours));
    }
    expectEqualContents(whole.mapper().contents(), paged.mapper().contents());
    expectEqualMeshes(whole.mesh(), paged.mesh());
    if (way.space) expectEqualSpaces(*whole.mapper().space(), *paged.mapper().space());
    const MapStats stats = paged.mapper().stats();
    EXPECT_EQ(stats.refused_blocks, 0u);
    EXPECT_LT(stats.map_bytes_peak, whole.mapper().stats().map_bytes_peak);
    EXPECT_EQ(stats.dropped_blocks, whole.mapper().stats().dropped_blocks);
    EXPECT_GT(stats.pages.written, 50u);
    EXPECT_GT(stats.pages.read, 50u);
    EXPECT_EQ(stats.pages.lost + stats.pages.failures, 0u) << stats.pages.problem;
    EXPECT_GT(whole.most(), stats.max_map_bytes) << "otherwise nothing is tested";
  }

 private:
  TemporaryFolder folder_;
};

TEST_P(PagingParity, NormalRayCasting) { compare({}); }

TEST_P(PagingParity, OtherModes) {
  for (const auto& [mode, directional] :
       {std::pair(FusionMode::kNormalRayCasting, false), std::pair(FusionMode::kRayCasting, true),
        std::pair(FusionMode::kVoxelProjection, true)}) {
    SCOPED_TRACE(static_cast<int>(mode));
    Way way;
    way.mode = mode;
    way.directional = directional;
    if (!directional) way.budget_mb = 1;
    compare(way);
  }
}

/// Images exceed the budget, and meshes are made in parts.
TEST_P(PagingParity, SmallBudgets) {
  for (const int mesh_every : {0, 2}) {
    Way way;
    way.budget_mb = 2;
    way.mesh_every = mesh_every;
    compare(way);
  }
}

TEST_P(PagingParity, Colours) {
  Way way;
  way.painted = true;
  for (const int mesh_every : {0, 2}) {
    way.mesh_every = mesh_every;
    compare(way);
  }
}

TEST_P(PagingParity, RefinedMeshes) {
  Way way;
  way.refined = true;
  compare(way);
}

TEST_P(PagingParity, PosesThatAreFound) {
  Way way;
  way.aligned = true;
  compare(way);
}

TEST_P(PagingParity, RegionsAndSpace) {
  Way way;
  way.cleared = way.space = way.painted = true;
  way.budget_mb = 5;
  compare(way);
}

TEST_P(PagingParity, WhatIsFarIsDropped) {
  Way way;
  way.keep_radius_m = 9.0f;
  for (const int mesh_every : {0, 1}) {
    way.mesh_every = mesh_every;
    compare(way);
  }
}

/// A room, then two others alternately. Before each extraction, a part of the next room is emptied.
/// The next image meets blocks without arrays, which are removed as soon as their neighbours are
/// paged in.
TEST_P(PagingParity, BlocksThatGoWithinAFrame) {
  Way way;
  way.mesh_every = 0;
  way.turns = true;
  for (const auto& [painted, budget_mb] :
       {std::pair(false, 2), std::pair(false, 3), std::pair(true, 3)}) {
    SCOPED_TRACE(budget_mb);
    way.painted = painted;
    way.budget_mb = budget_mb;
    compare(way);
  }
}

INSTANTIATE_TEST_SUITE_P(All, PagingParity,
                         testing::Values(Candidate::kCpuTwoThreads, Candidate::kCuda),
                         [](const testing::TestParamInfo<Candidate>& info) {
                           return toString(info.param);
                         });

}  // namespace
}  // namespace dtsdf
