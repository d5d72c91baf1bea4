/// What is known of 32 x 32 x 32 cells, by cubes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/space.h"
#include "kernels/space/cells.h"

namespace dtsdf {

/// A cube of cells: where an image saw through, and where surfaces are.
struct CubeCells {
  CellMask free{}, surface{};
};

inline bool isEmpty(const CubeCells& cells) {
  return isEmpty(cells.free) && isEmpty(cells.surface);
}

inline CellState stateIn(const CubeCells& cube, int cell) {
  if (isIn(cube.surface, cell)) return CellState::kSurface;
  return isIn(cube.free, cell) ? CellState::kFree : CellState::kUnknown;
}

static_assert(kCubeSideLog2 == SpaceCube::kSideLog2, "one layout of cells");

inline SpaceCube asSpaceCube(const Vec3i& key, const CubeCells& cube) {
  SpaceCube known{firstCellOfCube(key), {}, {}};
  for (size_t z = 0; z < kWordsPerCube; ++z) {
    known.free[z] = cube.free.word[z] & ~cube.surface.word[z];
    known.surface[z] = cube.surface.word[z];
  }
  return known;
}

constexpr CellMask kAllCells{{~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0},
                              ~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0}}};

/// The cubes that something is known of, by their numbers.
class CellSector {
 public:
  /// What is known of a cube: all zeros if nothing is.
  CubeCells at(int number) const { return has(number) ? cubes_[placeOf(number)] : CubeCells{}; }

  /// The cube, made if it is not there; it stays where it is until another one comes or goes.
  CubeCells& make(int number) {
    const size_t place = placeOf(number);
    if (!has(number))
      cubes_.insert(cubes_.begin() + static_cast<std::ptrdiff_t>(place), CubeCells());
    known_ |= bit(number);
    return cubes_[place];
  }

  void erase(int number) {
    if (!has(number)) return;
    cubes_.erase(cubes_.begin() + static_cast<std::ptrdiff_t>(placeOf(number)));
    known_ &= ~bit(number);
  }

  bool has(int number) const { return (known_ & bit(number)) != 0; }
  bool isEmpty() const { return known_ == 0; }

  /// Calls visit(number, cells) for each.
  template <class Visit>
  void visit(const Visit& visit) const {
    size_t place = 0;
    for (uint64_t left = known_; left != 0; left &= left - 1) {
      visit(__builtin_ctzll(left), cubes_[place++]);
    }
  }

  size_t bytes() const { return sizeof(*this) + cubes_.capacity() * sizeof(CubeCells); }

  template <class Io>
  void visitRecord(Io& io) {
    io(known_);
    io.array(cubes_, static_cast<size_t>(__builtin_popcountll(known_)));
  }

 private:
  static_assert(kCubesPerSector == 64, "a bit for each cube");

  static uint64_t bit(int number) { return uint64_t{1} << number; }
  size_t placeOf(int number) const {
    return static_cast<size_t>(__builtin_popcountll(known_ & (bit(number) - 1)));
  }

  uint64_t known_ = 0;
  std::vector<CubeCells> cubes_;
};

}  // namespace dtsdf
