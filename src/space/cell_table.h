/// The cells that something is known of, by cubes of 8 x 8 x 8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "kernels/space/cells.h"
#include "map/slot_index.h"

namespace dtsdf {

/// A cube of cells: where an image saw through, and where surfaces are.
struct CellCube {
  Vec3i key;
  CellMask free;
  CellMask surface;
};

class CellTable {
 public:
  /// The cube, or null.
  const CellCube* find(const Vec3i& key) const;
  CellCube* find(const Vec3i& key);

  /// The cube, made if it is not there.
  CellCube& at(const Vec3i& key);

  /// Removes a cube of which nothing is known any more.
  void removeIfEmpty(const Vec3i& key);

  void clear() { *this = CellTable(); }

  /// Keys of all cubes, in the order of packed keys.
  std::vector<Vec3i> sortedKeys() const;

  size_t size() const { return slots_.size(); }
  size_t bytes() const { return slots_.memoryBytes() + cubes_.size() * sizeof(CellCube); }

 private:
  SlotIndex slots_;
  std::deque<CellCube> cubes_;  ///< By slot; grows without moving what is there.
  std::vector<int32_t> free_slots_;
};

}  // namespace dtsdf
