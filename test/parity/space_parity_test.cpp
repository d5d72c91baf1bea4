// What is known of space is the same on every backend, cell by cell, with the distances.
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

size_t countCells(Mapper& mapper, CellState state) {
  const std::vector<SpaceCell> cells = mapper.space()->cells();
  return static_cast<size_t>(std::count_if(
      cells.begin(), cells.end(), [state](const SpaceCell& cell) { return cell.state == state; }));
}

/// Both kinds are there, so that equal does not just mean empty.
void expectSpace(Mapper& mapper) {
  EXPECT_GT(countCells(mapper, CellState::kFree), 100u);
  EXPECT_GT(countCells(mapper, CellState::kSurface), 100u);
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

/// Nothing but space makes a GPU finish the frame before it is asked.
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
    ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
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

/// A tile knows its own cubes only, and those as the whole map does.
TEST_P(SpaceCellParity, OfATile) {
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
  for (const TestFrame& frame : frames) ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
  const auto own = pair.candidate().contents().free_cubes;
  ASSERT_EQ(own.size(), 1u);
  EXPECT_EQ(own[0].key, expected.key);
  EXPECT_EQ(own[0].cells, expected.cells);
  pair.compareMaps();
}

INSTANTIATE_TEST_SUITE_P(All, SpaceCellParity,
                         testing::Combine(testing::Values(Candidate::kCpuTwoThreads,
                                                          Candidate::kCuda),
                                          testing::Values(1, 2, 4, 8), testing::Bool()),
                         [](const testing::TestParamInfo<CellCase>& info) {
                           return toString(std::get<0>(info.param)) + "CellsOf" +
                                  std::to_string(std::get<1>(info.param)) +
                                  (std::get<2>(info.param) ? "" : "WithoutClearing");
                         });

class SpaceParity : public testing::TestWithParam<Candidate> {
 protected:
  void SetUp() override { skipWithout(GetParam()); }
};

TEST_P(SpaceParity, VoxelProjectionUndirected) {
  MapperParams params = spaceParams();
  params.fusion.mode = FusionMode::kVoxelProjection;
  params.map.directional = false;
  BackendPair pair(params, GetParam());
  for (const TestFrame& frame : makeTestFrames({})) {
    ASSERT_NO_FATAL_FAILURE(pair.integrate(frame.view()));
  }
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  expectSpace(pair.candidate());
}

/// Far from the origin, over depths that are fused and beyond: an image tells more than it maps.
TEST_P(SpaceParity, FarFromTheOriginAndBeyondTheRange) {
  MapperParams params = spaceParams();
  params.fusion.max_depth_m = 2.0f;
  params.space.max_range_m = 8.0f;
  BackendPair pair(params, GetParam());
  TestFrameSettings settings;
  settings.encoding = DepthEncoding::kFloat32;
  settings.offset_W = {2000.0, -3000.0, 150.0};
  for (const TestFrame& frame : makeTestFrames(settings)) {
    ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
  }
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  expectSpace(pair.candidate());
}

/// Images as small as one pixel and as high as no grid of threads is; and those that are refused,
/// which show nothing.
TEST_P(SpaceParity, FramesOfChangingSizeAndBadFrames) {
  BackendPair pair(spaceParams(), GetParam());
  std::vector<TestFrame> frames;
  for (const int width : {64, 200, 33}) {
    TestFrameSettings settings;
    settings.width = settings.height = width;
    settings.count = 1;
    frames.push_back(makeTestFrames(settings)[0]);
    TestFrame bad = frames.back();
    bad.frame.intrinsics.fx = 0.0f;
    frames.push_back(bad);
  }
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 3000000}, {3000000, 1}, {5, 7}}) {
    TestFrame flat;
    flat.frame = frames[0].frame;
    flat.frame.encoding = DepthEncoding::kUint16;
    flat.frame.unit_m = 0.001f;
    flat.frame.width = width;
    flat.frame.height = height;
    flat.frame.row_bytes = width * sizeof(uint16_t);
    flat.pixels.assign(flat.frame.row_bytes * static_cast<size_t>(height), 0);
    std::fill_n(flat.pixels.begin(), std::min<size_t>(flat.pixels.size(), 200), 7);  // 1.8 m
    frames.push_back(flat);
  }
  for (const TestFrame& frame : frames) {
    ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
    ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  }
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  expectSpace(pair.candidate());
}

/// What lies in a region is unknown again, also with the last frame and an extraction under way.
TEST_P(SpaceParity, RegionsAreCleared) {
  BackendPair pair(spaceParams(), GetParam());
  TestFrameSettings settings;
  settings.noise = true;
  settings.count = 6;
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  for (size_t i = 0; i < frames.size(); ++i) {
    SCOPED_TRACE("frame " + std::to_string(i));
    ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frames[i].view()));
    if (i % 3 != 0) pair.beginMeshUpdate();
    const auto t = static_cast<double>(i);
    const Eigen::Vector3d at = frames[i].frame.T_W_C * Eigen::Vector3d(0.2 * t - 0.5, 0.1, 1.2);
    BoxRegion box;
    box.T_W_B = Eigen::Translation3d(at) *
                Eigen::AngleAxisd(0.4 * t, Eigen::Vector3d(1.0, 2.0, 3.0).normalized());
    box.size_m = {0.5 + 0.2 * t, 0.7, 1.5};
    pair.clearRegion(i % 2 == 0 ? Region(box) : Region(SphereRegion{at, 0.3 + 0.1 * t}));
    EXPECT_EQ(pair.candidate().space()->stateOf(pair.candidate().space()->cellAt(at)),
              CellState::kUnknown);
    ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
    if (i % 2 == 0) {
      ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    }
    ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  }
  expectSpace(pair.candidate());
  ASSERT_NO_FATAL_FAILURE(pair.clearRegion(SphereRegion{Eigen::Vector3d::Zero(), 1000.0}));
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  EXPECT_TRUE(pair.candidate().space()->cells().empty());
  pair.compareSpaces();
}

/// A camera that is carried off, each room out of the last one's radius.
TEST_P(SpaceParity, WhatIsFarIsDropped) {
  for (const int mesh_every : {0, 1, 3}) {
    MapperParams params = spaceParams();
    params.fusion.max_depth_m = 4.0f;
    params.map.keep_radius_m = 4.5f;
    BackendPair pair(params, GetParam());
    int count = 0;
    for (int room = 0; room < 3; ++room) {
      TestFrameSettings settings;
      settings.offset_W = {6.0 * room, -3.0 * room, 0.0};
      for (TestFrame& frame : makeTestFrames(settings)) {
        if (room == 1) frame.frame.keep_center_W = settings.offset_W;
        ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
        if (++count % 5 == 0) {
          ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
        }
        if (mesh_every > 0 && count % mesh_every == 0) {
          ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
        }
      }
    }
    ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
    expectSpace(pair.candidate());
    const Space& space = *pair.candidate().space();
    for (const SpaceCell& known : space.cells()) EXPECT_GT(known.cell.x * space.cellSize_m(), 4.0);
  }
}

/// A map that is taken out of one backend goes on in the other, with the last frame on its way.
TEST_P(SpaceParity, GoOnFromEachOthersContents) {
  BackendPair pair(spaceParams(), GetParam());
  ASSERT_NO_FATAL_FAILURE(pair.swapContents());  // empty
  TestFrameSettings settings;
  settings.count = 6;
  int count = 0;
  for (const TestFrame& frame : makeTestFrames(settings)) {
    ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
    if (++count % 2 != 0) continue;
    ASSERT_NO_FATAL_FAILURE(pair.swapContents());
    EXPECT_GT(countCells(pair.candidate(), CellState::kFree), 100u);
    EXPECT_EQ(countCells(pair.candidate(), CellState::kSurface), 0u) << "they come with the mesh";
    ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  }
  expectSpace(pair.candidate());
}

/// What is free has its own part of the budget: the same cubes are refused whenever the mesh is
/// made.
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
      ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
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

/// Squared distances again, from all pairs of cells.
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

/// Over one sector and over many, in all of them and beyond their reach, after each of some frames.
TEST_P(SpaceParity, DistancesAreExactHoweverFarTheyReach) {
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
      ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
      pair.clearRegion(SphereRegion{frame.frame.T_W_C * Eigen::Vector3d(0.1, 0.1, 1.5), 0.4});
      ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
      ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
      ASSERT_NO_FATAL_FAILURE(expectExactDistances(*pair.candidate().space(), reach));
    }
  }
}

TEST_P(SpaceParity, ClearForgetsEverything) {
  BackendPair pair(spaceParams(), GetParam());
  TestFrameSettings settings;
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  Space* const space = pair.candidate().space();
  for (int round = 0; round < 2; ++round) {
    for (const TestFrame& frame : frames) {
      ASSERT_NO_FATAL_FAILURE(pair.integrateOnly(frame.view()));
    }
    pair.beginMeshUpdate();
    if (round == 1) break;
    pair.clear();
    EXPECT_TRUE(space->cells().empty());
    EXPECT_EQ(pair.candidate().space(), space) << "lives as long as the mapper";
  }
  ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
  ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
  expectSpace(pair.candidate());
}

INSTANTIATE_TEST_SUITE_P(All, SpaceParity,
                         testing::Values(Candidate::kCpuTwoThreads, Candidate::kCuda),
                         [](const testing::TestParamInfo<Candidate>& info) {
                           return toString(info.param);
                         });

}  // namespace
}  // namespace dtsdf
