// Checks that free-space cells and distances are the same on every backend.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <tuple>

#include "parity/backend_comparison.h"
#include "parity/test_frames.h"

namespace dtsdf {
namespace {

MapperParams spaceParams(float voxel_size_m = 0.04f) {
  MapperParams params;
  params.map.voxel_size_m = voxel_size_m;
  params.mesh.min_support = 1;
  params.space.enabled = true;
  params.space.max_distance_m = 0.8f;
  return params;
}

void skipWithout(Candidate candidate) {
  const std::string reason = reasonToSkip(candidate);
  if (!reason.empty()) GTEST_SKIP() << reason;
}

using CellCase = std::tuple<Candidate, int, bool>;

class SpaceCellParity : public testing::TestWithParam<CellCase> {
 protected:
  void SetUp() override { skipWithout(std::get<0>(GetParam())); }
};

/// Nothing else is read after a frame, so reading the cells must make the GPU finish the frame.
TEST_P(SpaceCellParity, MovingCamera) {
  const auto [candidate, cell_voxels, clearing] = GetParam();
  MapperParams params = spaceParams();
  params.space.cell_voxels = cell_voxels;
  params.fusion.clearing = clearing;
  BackendPair pair(params, candidate);
  TestFrameSettings settings;
  settings.noise = true;
  settings.count = 5;
  int count = 0;
  for (const TestFrame& frame : makeTestFrames(settings)) {
    SCOPED_TRACE("frame " + std::to_string(count));
    ASSERT_NO_FATAL_FAILURE(pair.integrateUnchecked(frame.view()));
    if (++count % 2 == 0) {
      ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
    }
    if (count % 3 == 0) {
      ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    }
  }
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  expectSpace(pair.candidate());
  pair.compareMaps();
}

/// A map restricted to one cube of cells contains only this cube, as it is in the whole map.
TEST_P(SpaceCellParity, TileOfAMap) {
  const auto [candidate, cell_voxels, clearing] = GetParam();
  MapperParams params = spaceParams();
  params.space.cell_voxels = cell_voxels;
  params.fusion.clearing = clearing;
  TestFrameSettings settings;
  settings.count = 3;
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  const auto whole = makeProbedMapper(params);
  for (const TestFrame& frame : frames) whole->integrate(frame.view());
  const auto all = whole->contents().free_cubes;
  ASSERT_GT(all.size(), 2u);
  const MapFreeCube& expected = all[all.size() / 2];
  const MapExtent one{BlockExtent(), BlockExtent(), {expected.key, expected.key}};
  BackendPair pair(params, candidate);
  pair.reference().restrictTo(one);
  pair.candidate().restrictTo(one);
  for (const TestFrame& frame : frames)
    ASSERT_NO_FATAL_FAILURE(pair.integrateUnchecked(frame.view()));
  const auto own = pair.candidate().contents().free_cubes;
  ASSERT_EQ(own.size(), 1u);
  EXPECT_EQ(own[0].key, expected.key);
  EXPECT_EQ(own[0].cells, expected.cells);
  pair.compareMaps();
}

std::string nameOfCells(const testing::TestParamInfo<CellCase>& info) {
  return toString(std::get<0>(info.param)) + "CellsOf" + std::to_string(std::get<1>(info.param)) +
         (std::get<2>(info.param) ? "" : "WithoutClearing");
}

INSTANTIATE_TEST_SUITE_P(TwoThreads, SpaceCellParity,
                         testing::Combine(testing::Values(Candidate::kCpuTwoThreads),
                                          testing::Values(1, 4), testing::Values(true)),
                         nameOfCells);
INSTANTIATE_TEST_SUITE_P(All, SpaceCellParity,
                         testing::Combine(testing::Values(Candidate::kCuda),
                                          testing::Values(1, 2, 4, 8), testing::Bool()),
                         nameOfCells);

class SpaceParity : public testing::TestWithParam<Candidate> {
 protected:
  void SetUp() override { skipWithout(GetParam()); }
};

/// Free cells have their own part of the budget. Both mappers refuse the same number of cubes,
/// whether or not the mesh is updated between frames.
TEST_P(SpaceParity, UpToTheBudget) {
  for (const int mesh_every : {0, 2}) {
    MapperParams params = spaceParams(0.02f);
    params.map.max_memory_mb = 4;
    params.space.cell_voxels = 1;
    BackendPair pair(params, GetParam());
    int count = 0;
    TestFrameSettings settings;
    settings.width = 80;
    settings.height = 60;
    for (const TestFrame& frame : makeTestFrames(settings)) {
      ASSERT_NO_FATAL_FAILURE(pair.integrateUnchecked(frame.view()));
      if (mesh_every > 0 && ++count % mesh_every == 0) pair.updateMesh();
    }
    ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
    const MapStats stats = pair.candidate().stats();
    EXPECT_EQ(stats.refused_cubes, pair.reference().stats().refused_cubes);
    EXPECT_GT(stats.refused_cubes, 0u);
    EXPECT_GT(stats.refused_blocks, 0u);
    EXPECT_LE(stats.map_bytes + stats.free_bytes, size_t{4} << 20);
    expectSpace(pair.candidate());
  }
}

/// Compares squared distances with the minimum over all surface cells.
void expectExactDistances(const Space& space, int reach) {
  std::vector<Vec3i> surfaces;
  for (const SpaceCell& known : space.cells()) {
    if (known.state == CellState::kSurface) surfaces.push_back(known.cell);
  }
  ASSERT_GT(surfaces.size(), 100u);
  std::mt19937 random(1);
  std::uniform_int_distribution<int32_t> aside(-reach - 2, reach + 2);
  for (int i = 0; i < 300; ++i) {
    const Vec3i& some = surfaces[random() % surfaces.size()];
    const Vec3i cell{some.x + aside(random), some.y + aside(random), some.z + aside(random)};
    int least = reach * reach + 1;
    for (const Vec3i& s : surfaces) {
      const Vec3i d{s.x - cell.x, s.y - cell.y, s.z - cell.z};
      least = std::min(least, d.x * d.x + d.y * d.y + d.z * d.z);
    }
    ASSERT_EQ(space.squaredDistance(cell), least <= reach * reach ? least : -1);
  }
}

/// Tests distances within a sector, across many sectors, and beyond the maximum distance.
TEST_P(SpaceParity, DistancesAreExactAtAnyReach) {
  for (const int reach : {1, 25, 33, 130}) {
    SCOPED_TRACE(reach);
    MapperParams params = spaceParams();
    params.space.cell_voxels = 1;
    params.space.max_distance_m = 0.04f * static_cast<float>(reach);
    BackendPair pair(params, GetParam());
    TestFrameSettings settings;
    settings.noise = true;
    settings.count = reach < 100 ? 3 : 1;
    for (const TestFrame& frame : makeTestFrames(settings)) {
      ASSERT_NO_FATAL_FAILURE(pair.integrateUnchecked(frame.view()));
      pair.clearRegion(SphereRegion{frame.frame.T_W_C * Eigen::Vector3d(0.1, 0.1, 1.5), 0.4});
      ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
      ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
      ASSERT_NO_FATAL_FAILURE(expectExactDistances(*pair.candidate().space(), reach));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, SpaceParity,
                         testing::Values(Candidate::kCpuTwoThreads, Candidate::kCuda),
                         [](const testing::TestParamInfo<Candidate>& info) {
                           return toString(info.param);
                         });

}  // namespace
}  // namespace dtsdf
