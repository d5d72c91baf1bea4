// Tests the states of free-space cells, and distances to surfaces, in maps of analytic scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <random>
#include <tuple>

#include "dtsdf_mapping/mesh.h"
#include "support/depth_frames.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

MapperParams spaceParams(int cell_voxels = 4, bool directional = true) {
  MapperParams params = makeCpuParams(
      directional ? FusionMode::kNormalRayCasting : FusionMode::kVoxelProjection, directional);
  params.threads = 1;  // on a busy machine, several threads would wait for each other
  params.space.enabled = true;
  params.space.cell_voxels = cell_voxels;
  params.space.max_distance_m = 0.6f;
  params.space.max_range_m = 3.5f;
  params.mesh.min_support = 1;
  return params;
}

std::vector<Eigen::Isometry3d> posesInRoom() {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 8; ++i) {
    const double a = i * 2.0 * M_PI / 8.0;
    poses.push_back(lookAt(Vector3d(1.2 * std::cos(a), 0.9 * std::sin(a), 0.3 * std::sin(3 * a)),
                           Vector3d(0.3 * std::cos(a + 2.0), 0.3 * std::sin(a + 2.0), -0.1),
                           Vector3d::UnitZ()));
  }
  return poses;
}

std::unique_ptr<Mapper> mapOf(const Scene& scene, const std::vector<Eigen::Isometry3d>& poses,
                              const MapperParams& params) {
  auto mapper = makeMapper(params);
  for (const Eigen::Isometry3d& T_W_C : poses) mapper->integrate(renderFrame(scene, T_W_C).view());
  mapper->updateMesh();
  mapper->space()->updateDistances();
  return mapper;
}

Vector3d middleOf(const Space& space, const Vec3i& cell) {
  return space.cellSize_m() * Vector3d(cell.x + 0.5, cell.y + 0.5, cell.z + 0.5);
}

TEST(Space, IsOffByDefault) { EXPECT_EQ(makeMapper(makeCpuParams())->space(), nullptr); }

class SpaceCells : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sizes, SpaceCells, ::testing::Values(1, 2, 4, 8));

/// Free cells lie on the free side of all surfaces, and most cells away from surfaces are known to
/// be free.
TEST_P(SpaceCells, FreeCellsLieInFreeSpace) {
  const Scene scene = makeBallRoom();
  const auto mapper = mapOf(scene, posesInRoom(), spaceParams(GetParam()));
  const Space& space = *mapper->space();
  const double half = 0.5 * space.cellSize_m();
  size_t free_cells = 0;
  for (const SpaceCell& known : space.cells()) {
    if (known.state != CellState::kFree) continue;
    ++free_cells;
    EXPECT_GT(scene.signedDistance(middleOf(space, known.cell)), 0.5 * half);
  }
  // Points in the middle of the room, away from surfaces.
  size_t inside = 0, found = 0;
  for (double x = -0.8; x < 0.8; x += 0.1) {
    for (double y = -0.6; y < 0.6; y += 0.1) {
      const Vector3d p(x, y, 0.0);
      if (scene.signedDistance(p) < 2.0 * space.cellSize_m() + 0.05) continue;
      ++inside;
      if (space.stateOf(space.cellAt(p)) == CellState::kFree) ++found;
    }
  }
  EXPECT_GT(free_cells, 100u);
  EXPECT_GE(static_cast<double>(found), 0.9 * static_cast<double>(inside));
}

/// Compares distances with those to the nearest vertex, which is close to the nearest point of the
/// mesh.
TEST_P(SpaceCells, DistancesMatchTheMesh) {
  const MapperParams params = spaceParams(GetParam());
  const auto mapper = makeMapper(params);
  MeshStore store(params.map.voxel_size_m);
  for (const Eigen::Isometry3d& T_W_C : posesInRoom()) {
    mapper->integrate(renderFrame(makeBallRoom(), T_W_C).view());
  }
  store.apply(mapper->updateMesh());
  Space& space = *mapper->space();
  space.updateDistances();
  const Mesh mesh = store.assemble();
  double squares = 0.0, worst = 0.0;
  size_t count = 0, number = 0;
  for (const SpaceCell& known : space.cells()) {
    if (known.state != CellState::kFree || number++ % (GetParam() < 4 ? 997 : 31) != 0) continue;
    const Vector3d p = middleOf(space, known.cell);
    double truth = 1e9;
    for (const Vec3f& v : mesh.vertices_m) {
      truth = std::min(truth, (Vector3d(v.x, v.y, v.z) - p).norm());
    }
    const SpaceDistance answer = space.distanceAt(p);
    ASSERT_TRUE(answer.known);
    if (truth > 0.5) continue;
    const double error = answer.distance_m - truth;
    squares += error * error;
    worst = std::max(worst, std::abs(error));
    ++count;
  }
  ASSERT_GT(count, 20u);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 0.5 * space.cellSize_m());
  EXPECT_LT(worst, 1.5 * space.cellSize_m());
}

/// Above the floor, the gradient points up and has length 1.
TEST(Space, GradientsPointAwayFromSurfaces) {
  const auto mapper = mapOf(makeBallRoom(), posesInRoom(), spaceParams(2));
  const Space& space = *mapper->space();
  const SpaceDistance beside_floor = space.distanceAt(Vector3d(-0.6, 0.4, -0.7));
  ASSERT_TRUE(beside_floor.known);
  EXPECT_NEAR(beside_floor.distance_m, 0.27, 0.03);
  EXPECT_NEAR(beside_floor.gradient.z, 1.0, 0.1);
  EXPECT_NEAR(beside_floor.gradient.x, 0.0, 0.1);
  EXPECT_NEAR(beside_floor.gradient.y, 0.0, 0.1);
}

/// Distances in unknown space are negative and rise to 0 at the surface. So below the floor, the
/// gradient points up.
TEST(Space, GradientsInUnknownSpacePointToSurfaces) {
  const auto mapper = mapOf(makeBallRoom(), posesInRoom(), spaceParams(2));
  const Space& space = *mapper->space();
  const Vector3d below_floor(-0.6, 0.4, -1.2);
  const SpaceDistance here = space.distanceAt(below_floor);
  ASSERT_FALSE(here.known);
  EXPECT_NEAR(here.distance_m, -0.23, 0.05);
  EXPECT_NEAR(here.gradient.z, 1.0, 0.1);
  EXPECT_NEAR(here.gradient.x, 0.0, 0.1);
  EXPECT_NEAR(here.gradient.y, 0.0, 0.1);
  EXPECT_GT(space.distanceAt(below_floor + Vector3d(0.0, 0.0, 0.1)).distance_m,
            here.distance_m + 0.05f);
}

TEST(Space, IsUnknownBehindWalls) {
  const auto mapper = mapOf(makeBallRoom(), posesInRoom(), spaceParams());
  const Space& space = *mapper->space();
  const SpaceDistance behind = space.distanceAt(Vector3d(0.0, 0.0, -1.3));
  EXPECT_FALSE(behind.known);
  EXPECT_LT(behind.distance_m, 0.0f);
  EXPECT_FALSE(space.distanceAt(Vector3d(NAN, 0.0, 0.0)).known);
  EXPECT_FALSE(space.distanceAt(Vector3d(1e30, 0.0, 0.0)).known);
  EXPECT_LT(space.distanceAt(Vector3d(1e30, 0.0, 0.0)).distance_m, 0.0f);
  EXPECT_FALSE(space.distanceAt(Vector3d(300.0, 0.0, 0.0)).known);
}

/// Whether two cells are connected by a path of free cells.
bool isConnected(const Space& space, const Vec3i& from, const Vec3i& to) {
  const auto keyOf = [](const Vec3i& c) { return std::make_tuple(c.x, c.y, c.z); };
  std::map<std::tuple<int, int, int>, bool> met;
  std::deque<Vec3i> open = {from};
  const std::vector<Vec3i> steps = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                    {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  while (!open.empty()) {
    const Vec3i cell = open.front();
    open.pop_front();
    if (cell.x == to.x && cell.y == to.y && cell.z == to.z) return true;
    for (const Vec3i& step : steps) {
      const Vec3i next{cell.x + step.x, cell.y + step.y, cell.z + step.z};
      if (met[keyOf(next)] || space.stateOf(next) != CellState::kFree) continue;
      met[keyOf(next)] = true;
      open.push_back(next);
    }
  }
  return false;
}

/// A 2 mm plate across a corridor, mapped from both sides, blocks every path, even with 80 mm
/// cells. Without the plate, there is a path.
TEST(Space, AThinPlateBlocksEveryPath) {
  for (const bool is_closed : {true, false}) {
    Scene scene;
    scene.add(Room{Vector3d(-2.0, -0.6, -0.6), Vector3d(2.0, 0.6, 0.6)});
    if (is_closed) scene.add(makeBox(Vector3d(0.013, 0.0, 0.0), Vector3d(0.002, 1.2, 1.2), 0.0));
    std::vector<Eigen::Isometry3d> poses;
    for (const double side : {-1.0, 1.0}) {
      for (int i = 0; i < 8; ++i) {
        const double y = -0.35 + 0.1 * i, z = 0.35 - 0.1 * i;
        poses.push_back(
            lookAt(Vector3d(1.7 * side, y, z), Vector3d(0.0, -y, -z), Vector3d::UnitZ()));
      }
    }
    const auto mapper = mapOf(scene, poses, spaceParams());
    const Space& space = *mapper->space();
    const Vec3i left = space.cellAt(Vector3d(-0.6, 0.0, 0.0)),
                right = space.cellAt(Vector3d(0.6, 0.0, 0.0));
    ASSERT_EQ(space.stateOf(left), CellState::kFree);
    ASSERT_EQ(space.stateOf(right), CellState::kFree);
    EXPECT_EQ(isConnected(space, left, right), !is_closed);
  }
}

/// A random view of a room, with or without a box.
SceneFrame randomLook(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  Scene scene;
  scene.add(Room{Vector3d(-0.9, -0.9, -0.7), Vector3d(0.9, 0.9, 0.7)});
  if (random() % 2 == 0) scene.add(makeBox({0.3, 0.2, -0.3}, {0.3, 0.3, 0.6}, 0.3));
  const Vector3d eye(-0.5 + 0.2 * any(random), 0.5 * any(random), 0.3 * any(random));
  const Vector3d at(0.4, 0.4 * any(random), -0.3 + 0.3 * any(random));
  return renderFrame(scene, lookAt(eye, at, Vector3d::UnitZ()), 48, 36);
}

/// The states and distances of all cells that are up to `reach` cells away from the origin.
std::string stateInBox(const Space& space, int reach) {
  std::string bytes;
  for (int z = -reach; z < reach; ++z) {
    for (int y = -reach; y < reach; ++y) {
      for (int x = -reach; x < reach; ++x) {
        const int squared = space.squaredDistance({x, y, z});
        bytes.push_back(static_cast<char>(space.stateOf({x, y, z})));
        bytes.append(reinterpret_cast<const char*>(&squared), sizeof(squared));
      }
    }
  }
  return bytes;
}

/// At random, a box appears or disappears, regions are cleared, and the mesh and distances are
/// updated. The resulting free-space grid equals that of a new mapper with the same map.
TEST(Space, RandomUpdatesMatchAFreshMapper) {
  std::mt19937 random(caseSeed(0));
  std::uniform_real_distribution<double> any(-0.8, 0.8);
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.05f, 1);
  params.mesh.min_support = 1;
  params.space.enabled = true;
  params.space.cell_voxels = 2;
  params.space.max_distance_m = 0.6f;
  constexpr int kReach = 20;  // in cells; this is beyond the walls of the room
  const auto mapper = makeMapper(params);
  size_t vanished = 0;
  for (int update = 1; update <= 100; ++update) {
    SCOPED_TRACE("update " + std::to_string(update));
    mapper->integrate(randomLook(random).view());
    if (random() % 4 == 0) {
      vanished +=
          mapper->clearRegion(SphereRegion{{any(random), any(random), any(random)}, 0.3}).voxels;
    }
    if (random() % 2 == 0) mapper->updateMesh();
    if (random() % 3 == 0) mapper->space()->updateDistances();
    if (update % 20 != 0) continue;
    mapper->updateMesh();
    mapper->space()->updateDistances();
    const auto scratch = makeMapper(params, mapper->contents());
    scratch->updateMesh();
    scratch->space()->updateDistances();
    ASSERT_EQ(mapper->space()->cells().size(), scratch->space()->cells().size());
    ASSERT_TRUE(stateInBox(*mapper->space(), kReach) == stateInBox(*scratch->space(), kReach));
  }
  EXPECT_GT(vanished, 500u);
}

/// Free cells get an eighth of the budget. Any more cells are refused and counted.
TEST(Space, StaysWithinItsPartOfTheBudget) {
  MapperParams params = spaceParams(1);
  params.map.max_memory_mb = 1;
  const auto mapper = makeMapper(params);
  EXPECT_EQ(mapper->stats().free_bytes, 0u);
  for (const Eigen::Isometry3d& T_W_C : posesInRoom()) {
    mapper->integrate(renderFrame(makeBallRoom(), T_W_C).view());
  }
  const MapStats stats = mapper->stats();
  EXPECT_GT(stats.refused_cubes, 0u);
  EXPECT_GT(stats.free_bytes, size_t{100} << 10);
  EXPECT_LE(stats.free_bytes, size_t{128} << 10);
  EXPECT_LE(stats.map_bytes, size_t{896} << 10);
  EXPECT_EQ(stats.max_map_bytes, size_t{896} << 10);
  mapper->clearRegion(SphereRegion{Vector3d::Zero(), 100.0});
  EXPECT_EQ(mapper->stats().free_bytes, 0u);
  mapper->clear();
  EXPECT_EQ(mapper->stats().refused_cubes, 0u);
}

TEST(Space, DoesNotChangeTheMesh) {
  const std::vector<SceneFrame> frames = renderFrames(makeBallRoom(), posesInRoom());
  MapperParams without = spaceParams();
  without.space.enabled = false;
  const Mesh with = reconstruct(spaceParams(), frames), plain = reconstruct(without, frames);
  EXPECT_EQ(with.triangles, plain.triangles);
}

}  // namespace
}  // namespace dtsdf
