// Checks that every candidate (the CPU on two threads, the GPU) gives the same results as the CPU
// on one thread: the same statistics after every frame, the same mesh updates and the same voxels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

#include "dtsdf_mapping/place_search.h"
#include "mapper/probed_mapper.h"
#include "parity/backend_comparison.h"
#include "parity/test_frames.h"
#include "support/block_snapshot.h"
#include "support/furnished_room.h"

namespace dtsdf {
namespace {

MapperParams makeParams(FusionMode mode, bool directional, float voxel_size_m) {
  MapperParams params;
  params.fusion.mode = mode;
  params.map.directional = directional;
  params.map.voxel_size_m = voxel_size_m;
  return params;
}

/// Enables the free-space grid, with cells four voxels wide.
MapperParams withSpace(MapperParams params) {
  params.mesh.min_support = 1;
  params.space.enabled = true;
  params.space.max_distance_m = 0.8f;
  return params;
}

void integrateAll(BackendPair& pair, const std::vector<TestFrame>& frames, int mesh_every) {
  for (size_t i = 0; i < frames.size(); ++i) {
    SCOPED_TRACE("frame " + std::to_string(i));
    ASSERT_NO_FATAL_FAILURE(pair.integrate(frames[i].view()));
    if (mesh_every > 0 && (i + 1) % mesh_every == 0) {
      ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    }
  }
}

/// Integrates depth images and paints colour images alternately.
void feedAll(BackendPair& pair, const std::vector<TestFrame>& frames,
             const std::vector<TestColours>& images, int mesh_every) {
  for (size_t i = 0; i < frames.size(); ++i) {
    SCOPED_TRACE("frame " + std::to_string(i));
    ASSERT_NO_FATAL_FAILURE(pair.integrate(frames[i].view()));
    ASSERT_NO_FATAL_FAILURE(pair.paint(images[i].view()));
    if (mesh_every > 0 && (i + 1) % mesh_every == 0) {
      ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    }
  }
}

/// Checks that the map is not empty, so that two empty maps cannot pass as equal.
void expectSurface(ProbedMapper& mapper) { EXPECT_GT(mapper.stats().voxel_arrays, 50u); }

class BackendParity : public testing::TestWithParam<Candidate> {
 protected:
  void SetUp() override {
    const std::string reason = reasonToSkip(GetParam());
    if (!reason.empty()) GTEST_SKIP() << reason;
  }
};

using ModeCase = std::tuple<Candidate, FusionMode, bool>;

class FusionModeParity : public testing::TestWithParam<ModeCase> {
 protected:
  void SetUp() override {
    const std::string reason = reasonToSkip(std::get<0>(GetParam()));
    if (!reason.empty()) GTEST_SKIP() << reason;
  }
};

TEST_P(FusionModeParity, MovingCameraMeshedEveryFrame) {
  const auto [candidate, mode, directional] = GetParam();
  BackendPair pair(withSpace(makeParams(mode, directional, 0.04f)), candidate);
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames({}), 1));
  expectSurface(pair.candidate());
  expectSpace(pair.candidate());
  pair.compareMaps();
}

/// Both mappers use mesh rules other than the defaults.
TEST_P(FusionModeParity, ChangedMeshRules) {
  const auto [candidate, mode, directional] = GetParam();
  Rules rules;
  rules.mesh.min_weight_share = 0.2f;
  rules.mesh.nearness_voxels = 1.0f;
  rules.mesh.measured_reach = 0.25f;
  BackendPair pair(makeParams(mode, directional, 0.04f), candidate, rules);
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames({}), 2));
  expectSurface(pair.candidate());
  pair.compareMaps();
}

/// Each triangle is split into four. The mesh is updated after every second frame and at the end.
TEST_P(FusionModeParity, RefinedMeshes) {
  const auto [candidate, mode, directional] = GetParam();
  MapperParams params = makeParams(mode, directional, 0.03f);
  params.mesh.refine = 1;
  BackendPair pair(params, candidate);
  TestFrameSettings settings;
  settings.noise = true;
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames(settings), 2));
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  expectSurface(pair.candidate());
  pair.compareMaps();
}

/// Each backend continues from the other's map, with depth, colour and free-space cells, even
/// during a mesh update or while the last frame is unfinished.
TEST_P(FusionModeParity, EachContinuesFromTheOthersMap) {
  const auto [candidate, mode, directional] = GetParam();
  BackendPair pair(withSpace(makeParams(mode, directional, 0.04f)), candidate);
  TestFrameSettings settings;
  settings.count = 9;
  settings.noise = true;
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  const std::vector<TestColours> images = makeTestColours(settings);
  ASSERT_NO_FATAL_FAILURE(pair.swapContents());  // empty
  for (size_t i = 0; i < frames.size(); ++i) {
    SCOPED_TRACE("frame " + std::to_string(i));
    ASSERT_NO_FATAL_FAILURE(pair.integrateUnchecked(frames[i].view()));
    if (i > 2) {
      ASSERT_NO_FATAL_FAILURE(pair.paint(images[i].view()));
    }
    if (i % 2 == 1) {
      ASSERT_NO_FATAL_FAILURE(pair.swapContents());
      EXPECT_GT(countCells(pair.candidate(), CellState::kFree), 100u);
      EXPECT_EQ(countCells(pair.candidate(), CellState::kSurface), 0u)
          << "there should be no surface cells before the mesh is updated";
      ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
    }
    if (i % 3 == 0) {
      pair.beginMeshUpdate();
    }
    if (i % 3 == 1) {
      ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
    }
  }
  ASSERT_NO_FATAL_FAILURE(pair.swapContents());
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  expectSurface(pair.candidate());
  pair.compareMaps();
}

TEST_P(FusionModeParity, NoisyFloatsMeshedAtTheEnd) {
  const auto [candidate, mode, directional] = GetParam();
  BackendPair pair(makeParams(mode, directional, 0.03f), candidate);
  TestFrameSettings settings;
  settings.encoding = DepthEncoding::kFloat32;
  settings.noise = true;
  settings.width = 200;  // not a multiple of the number of threads per CUDA block
  settings.height = 150;
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames(settings), 0));
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  expectSurface(pair.candidate());
  pair.compareMaps();
}

TEST_P(FusionModeParity, BudgetReached) {
  const auto [candidate, mode, directional] = GetParam();
  MapperParams params = makeParams(mode, directional, 0.02f);
  params.map.max_memory_mb = 6;
  BackendPair pair(params, candidate);
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames({}), 1));
  EXPECT_GT(pair.candidate().stats().refused_blocks, 0u);
  EXPECT_LE(pair.candidate().stats().map_bytes, size_t(6) << 20);
  pair.compareMaps();
}

TEST_P(FusionModeParity, PaintedAndMeshedEverySecondFrame) {
  const auto [candidate, mode, directional] = GetParam();
  BackendPair pair(makeParams(mode, directional, 0.03f), candidate);
  TestFrameSettings settings;
  settings.noise = true;
  ASSERT_NO_FATAL_FAILURE(feedAll(pair, makeTestFrames(settings), makeTestColours(settings), 2));
  EXPECT_GT(pair.candidate().stats().colour_bytes, 0u);
  pair.compareMaps();
}

std::string nameOfMode(const testing::TestParamInfo<ModeCase>& info) {
  const FusionMode mode = std::get<1>(info.param);
  return toString(std::get<0>(info.param)) +
         (mode == FusionMode::kVoxelProjection
              ? "VoxelProjection"
              : (mode == FusionMode::kRayCasting ? "RayCasting" : "NormalRayCasting")) +
         (std::get<2>(info.param) ? "Directional" : "Undirected");
}

/// random_scene_test.cpp tests two threads in modes that are drawn at random.
INSTANTIATE_TEST_SUITE_P(TwoThreads, FusionModeParity,
                         testing::Combine(testing::Values(Candidate::kCpuTwoThreads),
                                          testing::Values(FusionMode::kNormalRayCasting),
                                          testing::Bool()),
                         nameOfMode);
INSTANTIATE_TEST_SUITE_P(All, FusionModeParity,
                         testing::Combine(testing::Values(Candidate::kCuda),
                                          testing::Values(FusionMode::kVoxelProjection,
                                                          FusionMode::kRayCasting,
                                                          FusionMode::kNormalRayCasting),
                                          testing::Bool()),
                         nameOfMode);

/// A frame that outgrows the GPU's initial allocations for surfels, touched blocks, voxel arrays
/// and the mesh, and must be fused in several passes.
TEST(CudaParity, FineVoxelsOutgrowEveryBuffer) {
  const std::string reason = reasonToSkip(Candidate::kCuda);
  if (!reason.empty()) GTEST_SKIP() << reason;
  TestFrameSettings settings;
  settings.width = 640;
  settings.height = 480;
  settings.count = 2;
  settings.noise = true;
  for (const int refine : {0, 1}) {
    MapperParams params = makeParams(FusionMode::kNormalRayCasting, true, 0.006f);
    params.mesh.refine = refine;
    BackendPair pair(params, Candidate::kCuda);
    ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames(settings), 1));
    EXPECT_GT(pair.candidate().stats().voxel_arrays, 16384u);
    pair.compareMaps();
  }
}

/// Adds rooms until the GPU's hash table and array of blocks must grow.
TEST(CudaParity, ManyBlocksOutgrowTheTable) {
  const std::string reason = reasonToSkip(Candidate::kCuda);
  if (!reason.empty()) GTEST_SKIP() << reason;
  constexpr size_t kEnough = 70000;  // more than half of the hash table's initial 131072 entries
  BackendPair pair(makeParams(FusionMode::kNormalRayCasting, true, 0.008f), Candidate::kCuda);
  TestFrameSettings settings;
  settings.width = 320;
  settings.height = 240;
  settings.count = 4;
  settings.step_s = 2.0;
  for (int room = 0; room < 20 && pair.candidate().stats().blocks < kEnough; ++room) {
    settings.offset_W.x() = 16.0 * room;
    ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames(settings), 1));
  }
  EXPECT_GE(pair.candidate().stats().blocks, kEnough);
  EXPECT_EQ(pair.candidate().stats().refused_blocks, 0u);
  pair.compareMaps();
}

/// Each image is aligned, starting from a wrong pose, and fused at the aligned pose.
TEST_P(BackendParity, AlignedImages) {
  for (const bool directional : {true, false}) {
    BackendPair pair(makeParams(FusionMode::kNormalRayCasting, directional, 0.04f), GetParam());
    TestFrameSettings settings;
    settings.count = 6;
    settings.step_s = 0.1;
    settings.noise = true;
    size_t aligned = 0;
    for (const TestFrame& image : makeTestFrames(settings)) {
      DepthFrame frame = image.view();
      frame.T_W_C.translation() += Eigen::Vector3d(0.02, -0.03, 0.01);
      const Alignment expected = pair.reference().align(frame, {});
      const Alignment found = pair.candidate().align(frame, {});
      EXPECT_EQ(found.status, expected.status);
      EXPECT_TRUE(found.T_W_C.matrix() == expected.T_W_C.matrix());
      EXPECT_TRUE(found.covariance == expected.covariance);
      EXPECT_EQ(found.residual_m, expected.residual_m);
      aligned += expected.status == AlignmentStatus::kAligned ? 1 : 0;
      frame.T_W_C = expected.T_W_C;
      ASSERT_NO_FATAL_FAILURE(pair.integrate(frame));
    }
    EXPECT_GE(aligned, 3u);
    pair.compareMaps();
  }
}

/// Finds the pose of a camera in the map of a room, without an initial pose.
TEST_P(BackendParity, ACameraFoundInTheMap) {
  const Scene scene = roomWithFurniture();
  BackendPair pair(makeParams(FusionMode::kNormalRayCasting, true, 0.04f), GetParam());
  for (const Eigen::Isometry3d& T_W_C : viewsAround()) {
    ASSERT_NO_FATAL_FAILURE(pair.integrate(renderFrame(scene, T_W_C, 320, 240).view()));
  }
  const SceneFrame image = renderFrame(scene, cameraTowards({-0.5, 0.4, 1.4}, -0.3), 320, 240);
  const FoundPlace expected = findPlace(pair.reference(), image.view(), 2);
  const FoundPlace found = findPlace(pair.candidate(), image.view(), 0);
  EXPECT_EQ(expected.alignment.status, AlignmentStatus::kAligned);
  EXPECT_EQ(found.alignment.status, expected.alignment.status);
  EXPECT_TRUE(found.alignment.T_W_C.matrix() == expected.alignment.T_W_C.matrix());
  EXPECT_EQ(found.explained_share, expected.explained_share);
}

/// Compares views of a growing map before and after it is painted. Some have odd image sizes or
/// camera poses inside or behind surfaces.
TEST_P(BackendParity, RenderedViews) {
  for (const bool directional : {true, false}) {
    BackendPair pair(makeParams(FusionMode::kNormalRayCasting, directional, 0.03f), GetParam());
    TestFrameSettings settings;
    settings.count = 4;
    settings.noise = true;
    const std::vector<TestFrame> frames = makeTestFrames(settings);
    const std::vector<TestColours> images = makeTestColours(settings);
    const RenderCamera odd{131, 77, {110.0f, 120.0f, 60.0f, 41.5f}};
    ASSERT_NO_FATAL_FAILURE(pair.compareViews(odd, frames[0].view().T_W_C));  // an empty map
    for (size_t i = 0; i < frames.size(); ++i) {
      const DepthFrame frame = frames[i].view();
      ASSERT_NO_FATAL_FAILURE(pair.integrate(frame));
      if (i > 1) {
        ASSERT_NO_FATAL_FAILURE(pair.paint(images[i].view()));
      }
      const RenderCamera camera{frame.width, frame.height, frame.intrinsics};
      ASSERT_NO_FATAL_FAILURE(pair.compareViews(camera, frame.T_W_C));
      Eigen::Isometry3d moved = frame.T_W_C;
      moved.translate(Eigen::Vector3d(0.3, 0.1, 0.8));
      ASSERT_NO_FATAL_FAILURE(pair.compareViews(odd, moved));
      if (i % 2 == 0) continue;
      ASSERT_NO_FATAL_FAILURE(pair.beginMeshUpdate());  // during an extraction
      ASSERT_NO_FATAL_FAILURE(pair.compareViews(camera, frame.T_W_C));
      ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
      ASSERT_NO_FATAL_FAILURE(pair.compareViews(odd, moved));
    }
    const RenderedView view = pair.candidate().render(odd, frames[0].view().T_W_C);
    EXPECT_GT(std::count_if(view.depth_m.begin(), view.depth_m.end(),
                            [](float depth_m) { return depth_m > 0.0f; }),
              1000);
    pair.compareMaps();
  }
}

/// First extracts a mesh without colours, then paints it during mesh updates, with images of any
/// size down to a single pixel.
TEST_P(BackendParity, PaintedLaterWithImagesOfAnySize) {
  BackendPair pair(makeParams(FusionMode::kNormalRayCasting, true, 0.03f), GetParam());
  TestFrameSettings settings;
  settings.count = 3;
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames(settings), 1));
  for (const int width : {1, 5, 33, 400}) {
    for (const ColourEncoding encoding : {ColourEncoding::kMono8, ColourEncoding::kRgb8}) {
      SCOPED_TRACE(width);
      const int height = 2 * width / 3 + 1;
      for (const TestColours& image : makeTestColours(settings, width, height, encoding)) {
        pair.beginMeshUpdate();
        ASSERT_NO_FATAL_FAILURE(pair.paint(image.view()));
        ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
      }
    }
  }
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  pair.compareMaps();
}

/// Colours compete with voxels for the budget, before and after clear().
TEST_P(BackendParity, PaintedUpToTheBudgetAndCleared) {
  MapperParams params = makeParams(FusionMode::kNormalRayCasting, true, 0.02f);
  params.map.max_memory_mb = 6;
  BackendPair pair(params, GetParam());
  TestFrameSettings settings;
  settings.count = 6;
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  const std::vector<TestColours> images = makeTestColours(settings);
  ASSERT_NO_FATAL_FAILURE(pair.paint(images[0].view()));  // an empty map
  for (int round = 0; round < 2; ++round) {
    ASSERT_NO_FATAL_FAILURE(feedAll(pair, frames, images, 3));
    EXPECT_GT(pair.candidate().stats().refused_blocks, 0u);
    EXPECT_LE(pair.candidate().stats().map_bytes, size_t(6) << 20);
    pair.compareMaps();
    pair.clear();
  }
}

/// Only a part of the map is painted. The blocks around this part, which may occlude it, are fused
/// but not painted.
TEST_P(BackendParity, PaintedTileOfAMap) {
  MapperParams params = makeParams(FusionMode::kNormalRayCasting, true, 0.03f);
  params.adapt_exposure = false;
  params.max_paint_depth_m = 2.0f;
  const BlockExtent fused{{-9, -9, -9}, {4, 9, 9}}, painted{{-3, -9, -9}, {3, 9, 9}};
  BackendPair pair(params, GetParam());
  pair.reference().restrictTo({fused, painted, BlockExtent()});
  pair.candidate().restrictTo({fused, painted, BlockExtent()});
  TestFrameSettings settings;
  settings.noise = true;
  ASSERT_NO_FATAL_FAILURE(feedAll(pair, makeTestFrames(settings), makeTestColours(settings), 2));
  EXPECT_GT(pair.candidate().stats().colour_bytes, 0u);
  size_t beside = 0;
  for (const MapBlock& block : pair.candidate().contents().blocks) {
    EXPECT_TRUE(fused.contains(block.key));
    if (painted.contains(block.key)) continue;
    EXPECT_EQ(block.bricks, 0u);
    ++beside;
  }
  EXPECT_GT(beside, 0u);
  pair.compareMaps();
}

/// Cleared voxels lose their colours, and reused voxel arrays start without colours.
TEST_P(BackendParity, PaintedAndSeenThrough) {
  BackendPair pair(makeParams(FusionMode::kNormalRayCasting, true, 0.03f), GetParam());
  TestFrameSettings settings;
  settings.count = 2;
  settings.encoding = DepthEncoding::kFloat32;
  settings.offset_W = {300.0, -200.0, 50.0};
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  const std::vector<TestColours> images = makeTestColours(settings);
  ASSERT_NO_FATAL_FAILURE(feedAll(pair, frames, images, 1));
  const size_t before = pair.candidate().stats().colour_bytes;
  TestFrame far = frames[0];
  const float far_m = 50.0f;
  for (size_t i = 0; i < far.pixels.size(); i += sizeof(float)) {
    std::memcpy(&far.pixels[i], &far_m, sizeof(float));
  }
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, std::vector<TestFrame>(8, far), 2));
  EXPECT_LT(pair.candidate().stats().colour_bytes, before);
  ASSERT_NO_FATAL_FAILURE(feedAll(pair, frames, images, 1));
  pair.compareMaps();
}

/// The mesh must be that of the map at beginMeshUpdate(), even if frames are integrated before it
/// is finished.
TEST_P(BackendParity, FramesIntegratedDuringMeshUpdates) {
  BackendPair pair(makeParams(FusionMode::kNormalRayCasting, true, 0.02f), GetParam());
  TestFrameSettings settings;
  settings.width = 320;
  settings.height = 240;
  settings.count = 6;
  for (const TestFrame& frame : makeTestFrames(settings)) {
    ASSERT_NO_FATAL_FAILURE(pair.integrateUnchecked(frame.view()));
    ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
    pair.beginMeshUpdate();
  }
  ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());  // nothing has changed
  pair.compareMaps();
}

TEST_P(BackendParity, ClearForgetsEverything) {
  BackendPair pair(withSpace(makeParams(FusionMode::kNormalRayCasting, true, 0.03f)), GetParam());
  const Space* const space = pair.candidate().space();
  TestFrameSettings settings;
  const std::vector<TestFrame> before = makeTestFrames(settings);
  settings.first_s = 10.0;
  const std::vector<TestFrame> after = makeTestFrames(settings);
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, before, 2));
  pair.beginMeshUpdate();
  pair.clear();
  EXPECT_EQ(pair.candidate().stats().blocks, 0u);
  EXPECT_TRUE(pair.candidate().finishMeshUpdate().blocks.empty());
  EXPECT_TRUE(space->cells().empty());
  EXPECT_EQ(pair.candidate().space(), space)
      << "the free-space grid should live as long as the mapper";
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, after, 2));
  expectSpace(pair.candidate());
  pair.compareMaps();
}

/// Clears boxes and spheres in a painted map, some while a frame or an extraction is unfinished.
/// Freed arrays are reused, and cleared cells do not count as free.
TEST_P(BackendParity, RegionsAreCleared) {
  BackendPair pair(withSpace(makeParams(FusionMode::kNormalRayCasting, true, 0.03f)), GetParam());
  TestFrameSettings settings;
  settings.noise = true;
  settings.count = 8;
  settings.offset_W = {40.0, -20.0, 5.0};
  const std::vector<TestFrame> frames = makeTestFrames(settings);
  const std::vector<TestColours> images = makeTestColours(settings);
  size_t voxels = 0, blocks = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    SCOPED_TRACE("frame " + std::to_string(i));
    ASSERT_NO_FATAL_FAILURE(pair.integrateUnchecked(frames[i].view()));
    if (i % 4 < 2) {
      ASSERT_NO_FATAL_FAILURE(pair.paint(images[i].view()));
    }
    if (i % 3 != 0) pair.beginMeshUpdate();
    const auto t = static_cast<double>(i);
    const Eigen::Vector3d at = frames[i].frame.T_W_C * Eigen::Vector3d(0.2 * t - 0.8, 0.1, 2.0);
    BoxRegion box;
    box.T_W_B = Eigen::Translation3d(at) *
                Eigen::AngleAxisd(0.4 * t, Eigen::Vector3d(1.0, 2.0, 3.0).normalized());
    box.size_m = {0.5 + 0.2 * t, 0.7, 1.5};
    const ClearedRegion cleared =
        pair.clearRegion(i % 2 == 0 ? Region(box) : Region(SphereRegion{at, 0.3 + 0.1 * t}));
    voxels += cleared.voxels;
    blocks += cleared.blocks;
    const Space& space = *pair.candidate().space();
    EXPECT_NE(space.stateOf(space.cellAt(at)), CellState::kFree);
    ASSERT_NO_FATAL_FAILURE(pair.finishMeshUpdate());
    if (i % 2 == 0) {
      ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    }
    pair.compareMaps();
  }
  EXPECT_GT(voxels, 1000u);
  EXPECT_GT(blocks, 10u);
  expectSurface(pair.candidate());
  expectSpace(pair.candidate());
  ASSERT_NO_FATAL_FAILURE(pair.clearRegion(SphereRegion{settings.offset_W, 1000.0}));
  ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
  EXPECT_TRUE(snapshotOf(pair.candidate()).empty());
  EXPECT_TRUE(pair.candidate().space()->cells().empty());
  EXPECT_EQ(pair.candidate().stats().map_bytes, 0u);
  pair.compareMaps();
}

/// The camera jumps from room to room, each time farther than map/keep_radius_m. If nothing were
/// dropped, the map would exceed the budget.
TEST_P(BackendParity, FarBlocksAreDropped) {
  for (const int mesh_every : {0, 1, 3}) {
    MapperParams params = withSpace(makeParams(FusionMode::kNormalRayCasting, true, 0.03f));
    params.fusion.max_depth_m = 4.0f;
    params.map.keep_radius_m = 4.5f;
    params.map.max_memory_mb = 24;
    BackendPair pair(params, GetParam());
    for (int room = 0; room < 4; ++room) {
      TestFrameSettings settings;
      settings.noise = true;
      settings.offset_W = {6.0 * room, -3.0 * room, 0.0};
      std::vector<TestFrame> frames = makeTestFrames(settings);
      if (room == 2) {
        for (TestFrame& frame : frames) frame.frame.keep_center_W = settings.offset_W;
      }
      ASSERT_NO_FATAL_FAILURE(integrateAll(pair, frames, mesh_every));
      ASSERT_NO_FATAL_FAILURE(pair.compareSpaces());
      ASSERT_NO_FATAL_FAILURE(pair.paint(makeTestColours(settings)[0].view()));
    }
    EXPECT_GT(pair.candidate().stats().dropped_blocks, 500u);
    EXPECT_EQ(pair.candidate().stats().refused_blocks, 0u);
    ASSERT_NO_FATAL_FAILURE(pair.updateMesh());
    expectSpace(pair.candidate());
    const Space& space = *pair.candidate().space();
    for (const SpaceCell& known : space.cells()) EXPECT_GT(known.cell.x * space.cellSize_m(), 10.0);
    pair.compareMaps();
  }
}

/// Depths lie within and beyond fusion/max_depth_m; depths beyond it only free cells.
TEST_P(BackendParity, FarFromTheOrigin) {
  MapperParams params = withSpace(makeParams(FusionMode::kNormalRayCasting, true, 0.03f));
  params.fusion.max_depth_m = 2.0f;
  params.space.max_range_m = 8.0f;
  BackendPair pair(params, GetParam());
  TestFrameSettings settings;
  settings.encoding = DepthEncoding::kFloat32;
  settings.offset_W = {2000.0, -3000.0, 150.0};
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, makeTestFrames(settings), 1));
  expectSurface(pair.candidate());
  expectSpace(pair.candidate());
  pair.compareMaps();
}

/// Integrates images from a single pixel to more rows than a CUDA grid can have, and invalid
/// frames.
TEST_P(BackendParity, FramesOfChangingSizeAndBadFrames) {
  BackendPair pair(withSpace(makeParams(FusionMode::kRayCasting, true, 0.03f)), GetParam());
  std::vector<TestFrame> frames;
  for (const int width : {64, 200, 33}) {
    TestFrameSettings settings;
    settings.width = settings.height = width;
    settings.count = 1;
    frames.push_back(makeTestFrames(settings)[0]);
  }
  TestFrame flat = frames[0];
  flat.frame.encoding = DepthEncoding::kUint16;
  flat.frame.unit_m = 0.001f;
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 70000}, {1, 3000000}, {3000000, 1}, {5, 7}, {200, 200}}) {
    flat.frame.width = width;
    flat.frame.height = height;
    flat.frame.row_bytes = width * sizeof(uint16_t);
    flat.pixels.assign(flat.frame.row_bytes * static_cast<size_t>(height), 0);
    frames.push_back(flat);  // no measurement at all
    std::fill_n(flat.pixels.begin(), std::min<size_t>(flat.pixels.size(), 200), 7);  // 1.8 m
    frames.push_back(flat);
  }
  TestFrame bad = frames[0];
  bad.frame.intrinsics.fx = 0.0f;
  frames.push_back(bad);
  bad = frames[0];
  bad.frame.T_W_C.translation().x() = std::numeric_limits<double>::quiet_NaN();
  frames.push_back(bad);
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, frames, 1));
  expectSurface(pair.candidate());
  expectSpace(pair.candidate());
  pair.compareMaps();
}

/// If all pixels are out of range, a frame touches no block but clears voxels. The first of these
/// frames is integrated into an empty map; the others clear most of a room.
TEST_P(BackendParity, FramesWithNothingInRange) {
  BackendPair pair(makeParams(FusionMode::kNormalRayCasting, true, 0.03f), GetParam());
  TestFrameSettings settings;
  settings.count = 1;
  settings.encoding = DepthEncoding::kFloat32;
  const TestFrame room = makeTestFrames(settings)[0];
  TestFrame far = room;
  const float far_m = 50.0f;
  for (size_t i = 0; i < far.pixels.size(); i += sizeof(float)) {
    std::memcpy(&far.pixels[i], &far_m, sizeof(float));
  }
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, {far, room}, 1));
  const size_t before = pair.candidate().stats().voxel_arrays;
  ASSERT_NO_FATAL_FAILURE(integrateAll(pair, std::vector<TestFrame>(8, far), 1));
  EXPECT_LT(pair.candidate().stats().voxel_arrays, before / 2);
  pair.compareMaps();
}

INSTANTIATE_TEST_SUITE_P(All, BackendParity,
                         testing::Values(Candidate::kCpuTwoThreads, Candidate::kCuda),
                         [](const testing::TestParamInfo<Candidate>& info) {
                           return toString(info.param);
                         });

}  // namespace
}  // namespace dtsdf
