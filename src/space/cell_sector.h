/// A sector: 32 x 32 x 32 cells, stored in cubes of 8 x 8 x 8.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "dtsdf_mapping/space.h"
#include "kernels/space/cells.h"
#include "space/sector_table.h"

namespace dtsdf {

/// The free cells and the surface cells of a cube. A cell that is in both masks is a surface cell.
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

static_assert(kCubeSideLog2 == SpaceCube::kSideLog2,
              "SpaceCube and CubeCells must have the same layout");

inline SpaceCube toSpaceCube(const Vec3i& key, const CubeCells& cube) {
  SpaceCube known{firstCellOfCube(key), {}, {}};
  for (size_t z = 0; z < kWordsPerCube; ++z) {
    known.free[z] = cube.free.word[z] & ~cube.surface.word[z];
    known.surface[z] = cube.surface.word[z];
  }
  return known;
}

constexpr CellMask kAllCells{{~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0},
                              ~uint64_t{0}, ~uint64_t{0}, ~uint64_t{0}}};

/// The cubes of a sector that contain known cells. `number` is the index of a cube in the sector.
class CellSector {
 public:
  /// The cells of a cube; all zeros if none of them is known.
  CubeCells at(int number) const { return has(number) ? cubes_[placeOf(number)] : CubeCells{}; }

  /// Returns a cube, adding it if it is missing. The reference is valid until a cube is added or
  /// removed.
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
  bool isEmpty() const { return known_ == 0 && !is_lost_; }

  /// A substitute for a sector that could not be read: only cells added to it later are known.
  static CellSector lost() {
    CellSector sector;
    sector.is_lost_ = true;
    return sector;
  }
  bool isLost() const { return is_lost_; }

  /// Calls visit(number, cells) for each cube.
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
    io(known_, is_lost_);
    io.array(cubes_, static_cast<size_t>(__builtin_popcountll(known_)));
  }

 private:
  static_assert(kCubesPerSector == 64, "known_ has one bit per cube");

  static uint64_t bit(int number) { return uint64_t{1} << number; }
  size_t placeOf(int number) const {
    return static_cast<size_t>(__builtin_popcountll(known_ & (bit(number) - 1)));
  }

  uint64_t known_ = 0;
  bool is_lost_ = false;
  std::vector<CubeCells> cubes_;
};

using CellSectors = Sectors<CellSector>;

/// The sector whose surface cells are used for computing distances; null if `sectors` lacks it. A
/// sector that was lost or cannot be read counts as full of surfaces, so that no distance is
/// overestimated.
inline std::shared_ptr<const CellSector> surfacesIn(const CellSectors& sectors, PackedKey key) {
  static const auto everywhere = [] {
    auto sector = std::make_shared<CellSector>();
    for (int i = 0; i < kCubesPerSector; ++i) sector->make(i).surface = kAllCells;
    return sector;
  }();
  const auto place = sectors.find(key);
  if (place == sectors.end()) return nullptr;
  std::shared_ptr<const CellSector> sector = place->second.get();
  return sector == nullptr || sector->isLost() ? everywhere : sector;
}

inline CellState stateIn(const CellSectors& sectors, const Vec3i& cell) {
  const auto place = sectors.find(packKey(sectorOfCell(cell)));
  const auto sector = place == sectors.end() ? nullptr : place->second.get();
  if (sector == nullptr) return CellState::kUnknown;
  return stateIn(sector->at(cubeInSector(cubeOfCell(cell))), indexInCube(cell));
}

inline std::vector<SpaceCube> cubesOf(const CellSectors::value_type& sector_entry) {
  std::vector<SpaceCube> cubes;
  if (const auto cells = sector_entry.second.get()) {
    cells->visit([&](int number, const CubeCells& cube) {
      cubes.push_back(toSpaceCube(cubeOfSector(unpackKey(sector_entry.first), number), cube));
    });
  }
  return cubes;
}

/// Implements KnownSpace::cubes().
inline std::vector<SpaceCube> cubesIn(const CellSectors& sectors, int32_t first_z, int32_t last_z) {
  const int32_t low = first_z >> kCubeSideLog2, high = last_z >> kCubeSideLog2;
  std::vector<SpaceCube> found;
  for (const auto& sector_entry : sectors) {
    const int32_t z = unpackKey(sector_entry.first).z;
    if (z < first_z >> kSectorSideLog2 || z > last_z >> kSectorSideLog2) continue;
    for (const SpaceCube& cube : cubesOf(sector_entry)) {
      const int32_t cube_z = SpaceCube::cubeOf(cube.first).z;
      if (cube_z >= low && cube_z <= high) found.push_back(cube);
    }
  }
  return found;
}

/// A sorted set of cubes: for each sector, a bit mask of its cubes.
using CubeSet = std::map<PackedKey, uint64_t>;
constexpr size_t kCubeSetNodeBytes = sizeof(CubeSet::value_type) + 3 * sizeof(void*);

inline void insert(CubeSet& cubes, const Vec3i& cube) {
  cubes[packKey(sectorOfCube(cube))] |= uint64_t{1} << cubeInSector(cube);
}

/// Calls visit(cube, number) for each cube of a sector; `number` is the cube's index in the sector.
template <class Visit>
void visitCubes(const CubeSet::value_type& sector_entry, const Visit& visit) {
  const Vec3i sector = unpackKey(sector_entry.first);
  for (uint64_t left = sector_entry.second; left != 0; left &= left - 1) {
    const int number = __builtin_ctzll(left);
    visit(cubeOfSector(sector, number), number);
  }
}

}  // namespace dtsdf
