// Who follows the changes of space knows what is known; slices are cells of it.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <tuple>

#include "planning/ground_grid.h"
#include "support/depth_frames.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;
using Key = std::tuple<int, int, int>;

MapperParams spaceParams() {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, 0.04f);
  params.space.enabled = true;
  params.space.cell_voxels = 2;
  params.mesh.min_support = 1;
  return params;
}

std::map<Key, CellState> cellsOf(const Space& space) {
  std::map<Key, CellState> cells;
  for (const SpaceCell& known : space.cells()) {
    cells[{known.cell.x, known.cell.y, known.cell.z}] = known.state;
  }
  return cells;
}

/// Cells by the changes alone.
class Follower {
 public:
  void take(const SpaceChanges& changes) {
    if (changes.begins_anew) cells_.clear();
    for (const SpaceCube& cube : changes.cubes) put(cube);
  }
  const std::map<Key, CellState>& cells() const { return cells_; }

 private:
  void put(const SpaceCube& cube) {
    for (int i = 0; i < 512; ++i) {  // the layout as docs and header tell it, in other words
      const Key key{cube.first.x + i % 8, cube.first.y + i / 8 % 8, cube.first.z + i / 64};
      const auto has = [&](const std::array<uint64_t, 8>& mask) {
        return (mask[static_cast<size_t>(i / 64)] >> (i % 64) & 1u) != 0;
      };
      EXPECT_FALSE(has(cube.free) && has(cube.surface));
      cells_.erase(key);
      if (has(cube.surface)) cells_[key] = CellState::kSurface;
      if (has(cube.free)) cells_[key] = CellState::kFree;
    }
  }

  std::map<Key, CellState> cells_;
};

Eigen::Isometry3d poseOf(int i) {
  const double a = i * M_PI / 4.0;
  return lookAt(Vector3d(1.2 * std::cos(a), 0.9 * std::sin(a), 0.2),
                Vector3d(-0.4 * std::cos(a), -0.4 * std::sin(a), -0.1), Vector3d::UnitZ());
}

TEST(SpaceChanges, WhoFollowsThemKnowsWhatIsKnown) {
  const auto mapper = makeMapper(spaceParams());
  Follower follower;
  const auto expectSame = [&](const char* when) {
    follower.take(mapper->space()->takeChanges());
    ASSERT_FALSE(mapper->space()->cells().empty()) << when;
    EXPECT_TRUE(follower.cells() == cellsOf(*mapper->space())) << when;
  };
  for (int i = 0; i < 8; ++i) {
    mapper->integrate(renderFrame(makeBallRoom(), poseOf(i)).view());
    if (i == 3) mapper->clearRegion(SphereRegion{Vector3d(-1.0, 0.2, 0.0), 0.7});
    if (i % 2 == 1) mapper->updateMesh();
    expectSame("after a frame");
  }
  EXPECT_TRUE(mapper->space()->takeChanges().cubes.empty());
  mapper->clearRegion(BoxRegion{Eigen::Isometry3d::Identity(), Vector3d(9.0, 9.0, 1.0)});
  mapper->updateMesh();
  expectSame("after a cleared region");
  const SpaceChanges all = mapper->space()->takeChanges(true);
  EXPECT_TRUE(all.begins_anew);
  Follower late;
  late.take(all);
  EXPECT_TRUE(late.cells() == follower.cells());
  mapper->clear();
  const SpaceChanges none = mapper->space()->takeChanges();
  EXPECT_TRUE(none.begins_anew);
  EXPECT_TRUE(none.cubes.empty());
  mapper->integrate(renderFrame(makeBallRoom(), poseOf(0)).view());
  follower.take(none);
  expectSame("after a new beginning");
}

/// What is far from the camera is dropped, and a follower forgets it.
TEST(SpaceChanges, TellWhatWasLeftBehind) {
  MapperParams params = spaceParams();
  params.fusion.max_depth_m = 3.0f;
  params.map.keep_radius_m = 3.0f;
  const auto mapper = makeMapper(params);
  Follower follower;
  for (int i = 0; i < 6; ++i) {
    Scene scene;
    scene.add(Room{Vector3d(-1.49 + 2 * i, -1.18, -0.97), Vector3d(1.51 + 2 * i, 1.22, 1.03)});
    Eigen::Isometry3d T_W_C = poseOf(i);
    T_W_C.translation().x() += 2.0 * i;
    mapper->integrate(renderFrame(scene, T_W_C).view());
    mapper->updateMesh();
    follower.take(mapper->space()->takeChanges());
    EXPECT_TRUE(follower.cells() == cellsOf(*mapper->space())) << i;
  }
  EXPECT_FALSE(follower.cells().empty());
  EXPECT_GT(std::get<0>(follower.cells().begin()->first) * mapper->space()->cellSize_m(), -1.0);
}

TEST(DistanceSlice, HasTheKnownCellsAtAHeight) {
  const auto mapper = makeMapper(spaceParams());
  for (int i = 0; i < 8; ++i) mapper->integrate(renderFrame(makeBallRoom(), poseOf(i)).view());
  mapper->updateMesh();
  Space& space = *mapper->space();
  space.updateDistances();
  constexpr double kHeight_m = 0.05;
  const int32_t layer = space.cellAt(Vector3d(0.0, 0.0, kHeight_m)).z;
  std::map<Key, CellState> expected, found;
  for (const auto& [key, state] : cellsOf(space)) {
    if (std::get<2>(key) == layer) expected[key] = state;
  }
  double squares = 0.0;
  size_t free = 0;
  for (const SliceCell& cell : sliceAt(space, kHeight_m)) {
    found[{cell.cell.x, cell.cell.y, cell.cell.z}] = cell.state;
    const Vector3d p = pointInSlice(cell, space.cellSize_m(), kHeight_m);
    EXPECT_EQ(space.cellAt(p).x, cell.cell.x);
    EXPECT_EQ(space.cellAt(p).y, cell.cell.y);
    const double truth = makeBallRoom().signedDistance(p);
    if (cell.state != CellState::kFree || truth > 0.5) continue;
    squares += (cell.distance_m - truth) * (cell.distance_m - truth);
    ++free;
  }
  EXPECT_TRUE(found == expected);
  ASSERT_GT(free, 100u);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(free)), 0.75 * space.cellSize_m());
}

}  // namespace
}  // namespace dtsdf
