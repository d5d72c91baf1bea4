#include "planning/distance_slice.h"

namespace dtsdf {

Eigen::Vector3d pointInSlice(const SliceCell& cell, double cell_size_m, double height_m) {
  return {cell_size_m * (cell.cell.x + 0.5), cell_size_m * (cell.cell.y + 0.5), height_m};
}

std::vector<SliceCell> sliceAt(const KnownSpace& space, double height_m) {
  const int32_t layer = space.cellAt({0.0, 0.0, height_m}).z;
  const double cell_size_m = space.cellSize_m();
  std::vector<SliceCell> slice;
  for (const SpaceCube& cube : space.cubes(layer, layer)) {
    const auto z = static_cast<size_t>(layer - cube.first.z);
    for (uint64_t known = cube.free[z] | cube.surface[z]; known != 0; known &= known - 1) {
      SliceCell cell;
      cell.cell = cube.cellOf(layer - cube.first.z, __builtin_ctzll(known));
      cell.state = cube.stateOf(cell.cell);
      cell.distance_m = space.distanceAt(pointInSlice(cell, cell_size_m, height_m)).distance_m;
      slice.push_back(cell);
    }
  }
  return slice;
}

}  // namespace dtsdf
