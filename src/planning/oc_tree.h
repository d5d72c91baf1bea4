/// Adds the known cells of a map to an OctoMap tree; only for builds with OctoMap.
#pragma once

#include <octomap/OcTree.h>

#include <stdexcept>

#include "dtsdf_mapping/space.h"

namespace dtsdf {

/// Adds a free or surface cell. Call the tree's updateInnerOccupancy() after the last one.
/// @throws std::runtime_error if the cell is too far from the origin for the tree's keys.
inline void addToTree(const SpaceCell& known, octomap::OcTree& tree) {
  const auto keyOf = [](int32_t cell) {
    constexpr int32_t kMiddle = 1 << 15;  // keys have 16 bits per axis
    if (cell < -kMiddle || cell >= kMiddle) {
      throw std::runtime_error(
          "the map extends more than 32768 cells from the origin, the limit of "
          "an OctoMap tree; use larger cells (space/cell_voxels)");
    }
    return static_cast<octomap::key_type>(cell + kMiddle);
  };
  const Vec3i& cell = known.cell;
  tree.updateNode(octomap::OcTreeKey(keyOf(cell.x), keyOf(cell.y), keyOf(cell.z)),
                  known.state == CellState::kSurface, true);
}

}  // namespace dtsdf
