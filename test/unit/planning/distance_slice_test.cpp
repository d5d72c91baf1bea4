// Tests that a distance slice contains exactly the known cells of the free-space grid at its
// height, with their distances.
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

Eigen::Isometry3d poseOf(int i) {
  const double a = i * M_PI / 4.0;
  return lookAt(Vector3d(1.2 * std::cos(a), 0.9 * std::sin(a), 0.2),
                Vector3d(-0.4 * std::cos(a), -0.4 * std::sin(a), -0.1), Vector3d::UnitZ());
}

TEST(DistanceSlice, ContainsTheKnownCellsAtItsHeight) {
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
  for (const Eigen::Vector4f& point : sliceAt(space, kHeight_m)) {
    const Vector3d p = point.head<3>().cast<double>();
    const Vec3i cell = space.cellAt(p);
    found[{cell.x, cell.y, cell.z}] = space.stateOf(cell);
    const double truth = makeBallRoom().signedDistance(p);
    if (space.stateOf(cell) != CellState::kFree || truth > 0.5) continue;
    squares += (point.w() - truth) * (point.w() - truth);
    ++free;
  }
  EXPECT_TRUE(found == expected);
  ASSERT_GT(free, 100u);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(free)), 0.75 * space.cellSize_m());
}

}  // namespace
}  // namespace dtsdf
