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
  uint64_t touched = 0;  ///< The last turn of whoever follows changes in which it was asked for.
};

/// Cubes that may have changed, for one who follows them.
struct TouchedCubes {
  bool begins_anew = false;  ///< All that was there before may have gone.
  std::vector<const CellCube*> live;
  std::vector<Vec3i> gone;  ///< Keys; some of them may have come back.
};

class CellTable {
 public:
  /// The cube, or null.
  const CellCube* find(const Vec3i& key) const;
  CellCube* find(const Vec3i& key);

  /// The cube, made if it is not there. It counts as touched.
  CellCube& at(const Vec3i& key);

  /// Removes a cube of which nothing is known any more.
  void removeIfEmpty(const Vec3i& key);

  void clear() { *this = CellTable(); }

  /// Calls visit(key) for each cube, in any order; it may remove that one.
  template <class Visit>
  void visitKeys(const Visit& visit) const {
    for (size_t slot = 0; slot < keys_.size(); ++slot) {
      if (keys_[slot] != kNoCube) visit(unpackKey(keys_[slot]));
    }
  }

  /// All cubes, in the order of packed keys.
  std::vector<const CellCube*> sorted() const;

  /// Calls `visit` with each cube, in no order.
  template <class Visit>
  void forEach(const Visit& visit) const {
    for (size_t slot = 0; slot < keys_.size(); ++slot) {
      if (keys_[slot] != kNoCube) visit(cubes_[slot]);
    }
  }

  /// Cubes that were touched since the last call; at the first one, and with `all`, all of them.
  /// Those that are live are valid until the table is changed.
  TouchedCubes takeTouched(bool all);

  size_t size() const { return slots_.size(); }
  size_t bytes() const {
    return slots_.memoryBytes() + cubes_.size() * sizeof(CellCube) +
           (keys_.capacity() + free_slots_.capacity()) * sizeof(PackedKey) +
           touched_.capacity() * sizeof(int32_t);
  }

 private:
  static constexpr PackedKey kNoCube = ~PackedKey{0};

  void noteTouched(int32_t slot);

  SlotIndex slots_;
  std::deque<CellCube> cubes_;   ///< By slot; grows without moving what is there.
  std::vector<PackedKey> keys_;  ///< The same, close together for who looks at all of them.
  std::vector<int32_t> free_slots_;

  bool is_followed_ = false;      ///< Changes were taken, and all since then are known.
  uint64_t turn_ = 1;             ///< Goes on with each time that changes are taken.
  std::vector<int32_t> touched_;  ///< Slots asked for in this turn, while somebody follows,
  std::vector<Vec3i> gone_;       ///< and cubes removed.
};

}  // namespace dtsdf
