/// What is known of space as an OctoMap tree; only where OctoMap is installed.
#pragma once

#include <octomap/OcTree.h>

#include <stdexcept>

#include "dtsdf_mapping/space.h"

namespace dtsdf {

/// Adds a cell that is not unknown. After the last one the tree's updateInnerOccupancy() is due.
/// @throws std::runtime_error where the tree has no key for it.
inline void addToTree(const SpaceCell& known, octomap::OcTree& tree) {
  const auto keyOf = [](int32_t cell) {
    constexpr int32_t kMiddle = 1 << 15;  // keys have 16 bits an axis
    if (cell < -kMiddle || cell >= kMiddle) {
      throw std::runtime_error(
          "the map reaches farther than an OctoMap tree can, 32768 cells from "
          "the origin; use larger cells (space/cell_voxels)");
    }
    return static_cast<octomap::key_type>(cell + kMiddle);
  };
  const Vec3i& cell = known.cell;
  tree.updateNode(octomap::OcTreeKey(keyOf(cell.x), keyOf(cell.y), keyOf(cell.z)),
                  known.state == CellState::kSurface, true);
}

}  // namespace dtsdf
