/// Distances in a sector of 32 x 32 x 32 cells, computed from the surface cells in and around it.
/// Squared distances are minimised along x, then y, then z (Saito and Toriwaki, Pattern Recognition
/// 27, 1994).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "space/distance_task.h"

namespace dtsdf {

/// @tparam Value Integer type that can hold 2 * reach^2 + 1. The buffers are reused for each
/// sector.
template <class Value>
class SectorDistances {
 public:
  /// @param reach Maximum distance, in cells.
  /// @return null if no cell of the sector is within reach of a surface.
  SectorSquares run(const CellSectors& cells, const Vec3i& sector, int reach) {
    begin(firstCellOfCube(cubeOfSector(sector, 0)), reach);
    findRows(cells);
    if (rows_.empty()) return nullptr;
    combineRows();
    return combinePlanes();
  }

 private:
  using Line = std::array<Value, kSectorSide>;  ///< A value for each x of the sector.

  void begin(const Vec3i& first, int reach) {
    first_ = first - Vec3i{reach, reach, reach};
    if (reach != reach_) {
      reach_ = reach;
      far_ = static_cast<Value>(reach * reach + 1);
      window_ = kSectorSide + 2 * reach;
      squares_.resize(2 * static_cast<size_t>(kSectorSide + reach));
      for (int i = 0; i < static_cast<int>(squares_.size()); ++i) {
        const int aside = i - (kSectorSide + reach);
        squares_[static_cast<size_t>(i)] = static_cast<Value>(aside * aside);
      }
    }
    row_of_.assign(static_cast<size_t>(window_) * static_cast<size_t>(window_), -1);
    rows_.clear();
  }

  void findRows(const CellSectors& cells) {
    const Vec3i low = sectorOfCell(first_);
    const Vec3i high = sectorOfCell(first_ + Vec3i{window_ - 1, window_ - 1, window_ - 1});
    for (int32_t z = low.z; z <= high.z; ++z) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t x = low.x; x <= high.x; ++x) addSector(cells, {x, y, z});
      }
    }
  }

  void addSector(const CellSectors& cells, const Vec3i& sector) {
    const std::shared_ptr<const CellSector> surfaces = surfacesIn(cells, packKey(sector));
    if (surfaces == nullptr) return;
    surfaces->visit([&](int number, const CubeCells& cube) {
      addCube(cubeOfSector(sector, number), cube.surface);
    });
  }

  void addCube(const Vec3i& cube, const CellMask& surface) {
    constexpr uint64_t kRow = (1u << kCubeSide) - 1;
    const Vec3i corner = firstCellOfCube(cube) - first_;
    const auto reaches = [this](int32_t from) { return from > -kCubeSide && from < window_; };
    if (!reaches(corner.x) || !reaches(corner.y) || !reaches(corner.z)) return;
    for (int z = 0; z < kCubeSide; ++z) {
      if (surface.word[z] == 0 || !isInWindow(corner.z + z)) continue;
      for (int y = 0; y < kCubeSide; ++y) {
        const uint64_t row = surface.word[z] >> (kCubeSide * y) & kRow;
        if (row != 0 && isInWindow(corner.y + y)) addRow(row, corner + Vec3i{0, y, z});
      }
    }
  }

  bool isInWindow(int32_t at) const { return at >= 0 && at < window_; }

  /// Adds the surfaces in a row of a cube to the same row of the window (see first_).
  void addRow(uint64_t surfaces, const Vec3i& at) {
    int32_t& number = row_of_[static_cast<size_t>(at.y) +
                              static_cast<size_t>(at.z) * static_cast<size_t>(window_)];
    if (number < 0) {
      number = static_cast<int32_t>(rows_.size());
      rows_.emplace_back();
      rows_.back().fill(far_);
    }
    Line& line = rows_[static_cast<size_t>(number)];
    for (; surfaces != 0; surfaces &= surfaces - 1) {
      const int32_t x = at.x + __builtin_ctzll(surfaces);
      if (!isInWindow(x)) continue;
      const Value* const squares = squares_.data() + (kSectorSide + reach_) - (x - reach_);
      for (int i = 0; i < kSectorSide; ++i) line[i] = std::min(line[i], squares[i]);
    }
  }

  /// Takes the minima over y, for each plane of the window that has surfaces.
  void combineRows() {
    planes_.clear();
    plane_z_.clear();
    for (int32_t z = 0; z < window_; ++z) {
      const int32_t* const rows =
          row_of_.data() + static_cast<size_t>(z) * static_cast<size_t>(window_);
      bool is_any = false;
      for (int32_t y = 0; y < window_; ++y) {
        if (rows[y] < 0) continue;
        if (!is_any) beginPlane(z);
        is_any = true;
        const Line& row = rows_[static_cast<size_t>(rows[y])];
        for (int i = 0; i < kSectorSide; ++i) lower(planes_.back()[i], row, i + reach_ - y);
      }
    }
  }

  void beginPlane(int32_t z) {
    planes_.emplace_back();
    plane_z_.push_back(z);
    for (Line& line : planes_.back()) line.fill(far_);
  }

  /// Takes the minima over z.
  SectorSquares combinePlanes() {
    SectorSquares squares(new uint16_t[kCellsPerSector]);
    bool is_any_near = false;
    for (int32_t z = 0; z < kSectorSide; ++z) {
      for (int32_t y = 0; y < kSectorSide; ++y) {
        Line line;
        line.fill(far_);
        for (size_t i = 0; i < planes_.size(); ++i) {
          lower(line, planes_[i][y], z + reach_ - plane_z_[i]);
        }
        for (const Value value : line) is_any_near |= value < far_;
        for (int32_t x = 0; x < kSectorSide; x += kCubeSide) {
          std::transform(&line[x], &line[x] + kCubeSide, &squares[placeInSector({x, y, z})],
                         [this](Value value) {
                           return value < far_ ? static_cast<uint16_t>(value) : kSquaredFar;
                         });
        }
      }
    }
    if (!is_any_near) return nullptr;
    return squares;
  }

  /// Lowers each value of `line` to the value of `other` plus `aside` squared, if this sum is
  /// smaller.
  void lower(Line& line, const Line& other, int32_t aside) const {
    if (std::abs(aside) > reach_) return;
    const auto added = static_cast<Value>(aside * aside);
    for (int i = 0; i < kSectorSide; ++i) {
      line[i] = std::min(line[i], static_cast<Value>(other[i] + added));
    }
  }

  int reach_ = 0;
  Value far_ = 0;  ///< Stands for any squared distance greater than reach_ squared.
  int32_t window_ = 0;
  Vec3i first_{};  ///< First cell of the window, which extends the sector by reach_ on all sides.
  std::vector<Value> squares_;
  std::vector<int32_t> row_of_;  ///< Index in rows_ for each y and z of the window; -1 if none.
  std::vector<Line> rows_;       ///< Squared distances along x, for each row with surfaces.
  std::vector<std::array<Line, kSectorSide>> planes_;  ///< Planes with surfaces.
  std::vector<int32_t> plane_z_;                       ///< The z of each plane, in the window.
};

}  // namespace dtsdf
