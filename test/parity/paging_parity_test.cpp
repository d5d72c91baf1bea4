// Checks that every backend, when paging to disk, builds the same map, bit for bit, as the CPU on
// one thread without paging.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "parity/backend_comparison.h"
#include "parity/test_frames.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

/// The settings of a case, and its operations in addition to fusion.
struct Scenario {
  FusionMode mode = FusionMode::kNormalRayCasting;
  bool directional = true;
  int budget_mb = 4;
  int mesh_every = 3;  ///< Interval in frames; 0 for once, at the end.
  bool painted = false, aligned = false, cleared = false, space = false, refined = false;
  bool alternates = false;  ///< Alternates between rooms; see BlocksRemovedWithinAFrame.
  float keep_radius_m = 0.0f;
};

MapperParams paramsOf(const Scenario& scenario) {
  MapperParams params;
  params.fusion.mode = scenario.mode;
  params.map.directional = scenario.directional;
  params.map.voxel_size_m = 0.04f;
  params.map.keep_radius_m = scenario.keep_radius_m;
  params.fusion.max_depth_m = 4.0f;
  params.max_paint_depth_m = 2.0f;
  params.space.enabled = scenario.space;
  params.mesh.refine = scenario.refined ? 1 : 0;
  return params;
}

/// The camera visits three rooms in turn, then returns to the first.
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

/// A mapper that runs a scenario, and the mesh assembled from its updates.
class ScenarioRun {
 public:
  ScenarioRun(const Scenario& scenario, const MapperParams& params)
      : scenario_(scenario), mapper_(makeProbedMapper(params)), mesh_(params.map.voxel_size_m) {}

  void take(const TestFrame& frame, const TestColours& colours) {
    DepthFrame depth = frame.view();
    if (scenario_.aligned && count_ > 0) {
      depth.T_W_C.translate(Eigen::Vector3d(0.01, 0.0, 0.0));
      depth.T_W_C = mapper_->align(depth, PosePrior()).T_W_C;
    }
    ASSERT_EQ(mapper_->integrate(depth).status, FrameStatus::kFused);
    if (scenario_.painted) mapper_->paint(colours.view());
    ++count_;
    max_ = std::max(max_, mapper_->stats().map_bytes);
    if (scenario_.cleared && count_ == 9) {
      mapper_->clearRegion(SphereRegion{frame.frame.T_W_C.translation(), 7.0});
    }
    if (scenario_.mesh_every > 0 && count_ % scenario_.mesh_every == 0) updateMesh();
    if (scenario_.alternates) meshWithoutSome();
  }
  /// Clears a part of the next room and begins a mesh update. The next image, in which that part is
  /// visible, is fused during the update.
  void meshWithoutSome() {
    if (count_ > 1) mesh_.apply(mapper_->finishMeshUpdate());
    mapper_->clearRegion(
        SphereRegion{Eigen::Vector3d(6.0 * (count_ % 2), -3.0 * (count_ % 2), 1.0), 1.0});
    mapper_->beginMeshUpdate();
  }
  void updateMesh() { mesh_.apply(mapper_->updateMesh()); }
  Mesh mesh() {
    if (scenario_.alternates) mesh_.apply(mapper_->finishMeshUpdate());
    updateMesh();
    return mesh_.assemble();
  }
  ProbedMapper& mapper() { return *mapper_; }
  size_t most() const { return max_; }

 private:
  const Scenario scenario_;
  std::unique_ptr<ProbedMapper> mapper_;
  MeshStore mesh_;
  int count_ = 0;
  size_t max_ = 0;  ///< Maximum size of the map so far, in bytes.
};

class PagingParity : public testing::TestWithParam<Candidate> {
 protected:
  void SetUp() override {
    const std::string reason = reasonToSkip(GetParam());
    if (!reason.empty()) GTEST_SKIP() << reason;
  }

  void compare(const Scenario& scenario) {
    MapperParams params = paramsOf(scenario);
    params.backend = Backend::kCpu;
    params.threads = 1;
    ScenarioRun whole(scenario, params);
    params.backend = GetParam() == Candidate::kCuda ? Backend::kCuda : Backend::kCpu;
    params.threads = GetParam() == Candidate::kCpuTwoThreads ? 2 : 1;
    params.map.max_memory_mb = scenario.budget_mb;
    params.map.page_folder = folder_.path();
    params.map.page_max_gb = 1.0f;
    ScenarioRun paged(scenario, params);
    const auto all =
        scenario.alternates ? images({2, 1, 0, 1, 0, 1, 0, 1}, 1) : images(kThreeRooms, 3);
    for (const auto& [frame, colours] : all) {
      ASSERT_NO_FATAL_FAILURE(whole.take(frame, colours));
      ASSERT_NO_FATAL_FAILURE(paged.take(frame, colours));
    }
    expectEqualContents(whole.mapper().contents(), paged.mapper().contents());
    expectEqualMeshes(whole.mesh(), paged.mesh());
    if (scenario.space) expectEqualSpaces(*whole.mapper().space(), *paged.mapper().space());
    const MapStats stats = paged.mapper().stats();
    EXPECT_EQ(stats.refused_blocks, 0u);
    EXPECT_LT(stats.map_bytes_peak, whole.mapper().stats().map_bytes_peak);
    EXPECT_EQ(stats.dropped_blocks, whole.mapper().stats().dropped_blocks);
    EXPECT_GT(stats.pages.written, 50u);
    EXPECT_GT(stats.pages.read, 50u);
    EXPECT_EQ(stats.pages.lost + stats.pages.failures, 0u) << stats.pages.problem;
    EXPECT_GT(whole.most(), stats.max_map_bytes) << "the map should exceed the budget";
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
    Scenario scenario;
    scenario.mode = mode;
    scenario.directional = directional;
    if (!directional) scenario.budget_mb = 1;
    compare(scenario);
  }
}

/// Even a single image exceeds the budget, and meshes are extracted in parts.
TEST_P(PagingParity, SmallBudgets) {
  for (const int mesh_every : {0, 2}) {
    Scenario scenario;
    scenario.budget_mb = 2;
    scenario.mesh_every = mesh_every;
    compare(scenario);
  }
}

TEST_P(PagingParity, Colours) {
  Scenario scenario;
  scenario.painted = true;
  for (const int mesh_every : {0, 2}) {
    scenario.mesh_every = mesh_every;
    compare(scenario);
  }
}

TEST_P(PagingParity, RefinedMeshes) {
  Scenario scenario;
  scenario.refined = true;
  compare(scenario);
}

TEST_P(PagingParity, AlignedPoses) {
  Scenario scenario;
  scenario.aligned = true;
  compare(scenario);
}

TEST_P(PagingParity, RegionsAndSpace) {
  Scenario scenario;
  scenario.cleared = scenario.space = scenario.painted = true;
  scenario.budget_mb = 5;
  compare(scenario);
}

TEST_P(PagingParity, FarBlocksAreDropped) {
  Scenario scenario;
  scenario.keep_radius_m = 9.0f;
  for (const int mesh_every : {0, 1}) {
    scenario.mesh_every = mesh_every;
    compare(scenario);
  }
}

/// Maps a room, then two others alternately. Before each extraction, a part of the next room is
/// cleared. So the next image touches blocks without voxel arrays. Such blocks are removed as soon
/// as their neighbours are paged in.
TEST_P(PagingParity, BlocksRemovedWithinAFrame) {
  Scenario scenario;
  scenario.mesh_every = 0;
  scenario.alternates = true;
  for (const auto& [painted, budget_mb] :
       {std::pair(false, 2), std::pair(false, 3), std::pair(true, 3)}) {
    SCOPED_TRACE(budget_mb);
    scenario.painted = painted;
    scenario.budget_mb = budget_mb;
    compare(scenario);
  }
}

INSTANTIATE_TEST_SUITE_P(All, PagingParity,
                         testing::Values(Candidate::kCpuTwoThreads, Candidate::kCuda),
                         [](const testing::TestParamInfo<Candidate>& info) {
                           return toString(info.param);
                         });

}  // namespace
}  // namespace dtsdf
