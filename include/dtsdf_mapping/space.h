/// Free-space grid for planners: whether a cell is free, unknown or contains a surface, and the
/// distance to the nearest surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// State of a cell.
enum class CellState : unsigned char {
  kUnknown,  ///< Neither observed as free nor a surface cell.
  kFree,     ///< Was entirely in front of the measured surfaces in some image, and contains no
             ///< surface.
  kSurface,  ///< A surface of the mesh passes through it, facing in any direction.
};

/// The distance from a point to the nearest surface.
struct SpaceDistance {
  bool known = false;  ///< Whether the cell at the point is free or contains a surface.
  /// Distance to the nearest surface in metres, negative if the cell at the point is unknown. Its
  /// magnitude is at most space/max_distance_m, rounded up to whole cells.
  float distance_m = 0.0f;
  /// Gradient of distance_m along the axes of W; 0 at the maximum distance. If `known`, it points
  /// away from the nearest surface, otherwise towards it, since distance_m is then negative.
  Vec3f gradient{};
};

/// A free cell or a surface cell.
struct SpaceCell {
  Vec3i cell;       ///< Cell coordinates. The cell extends from `cell` to `cell` + 1, times
                    ///< cellSize_m(), in W.
  CellState state;  ///< Never kUnknown.
};

/// States of 8 x 8 x 8 cells. In a mask, bit x + 8 y of word z stands for the cell `first` + (x, y,
/// z).
struct SpaceCube {
  static constexpr int kSideLog2 = 3;           ///< Binary logarithm of kSide.
  static constexpr int kSide = 1 << kSideLog2;  ///< Edge length of a cube, in cells.
  using Mask = std::array<uint64_t, kSide>;     ///< One bit per cell.

  Vec3i first;   ///< First cell; its coordinates are multiples of kSide.
  Mask free;     ///< Free cells.
  Mask surface;  ///< Surface cells.

  /// Coordinates (in cubes) of the cube that contains a cell.
  static Vec3i cubeOf(const Vec3i& cell) {
    return {cell.x >> kSideLog2, cell.y >> kSideLog2, cell.z >> kSideLog2};
  }
  /// Index of a cell's bit within its word.
  static int bitOf(int32_t x, int32_t y) { return (x & (kSide - 1)) + kSide * (y & (kSide - 1)); }
  /// Cell that a bit of word `z` stands for.
  Vec3i cellOf(int32_t z, int bit) const {
    return {first.x + bit % kSide, first.y + bit / kSide, first.z + z};
  }
  /// State of a cell of this cube.
  CellState stateOf(const Vec3i& cell) const {
    const auto word = static_cast<std::size_t>(cell.z - first.z);
    const uint64_t bit = uint64_t{1} << bitOf(cell.x, cell.y);
    if ((surface[word] & bit) != 0) return CellState::kSurface;
    return (free[word] & bit) != 0 ? CellState::kFree : CellState::kUnknown;
  }
};

/// Changes to the free-space grid.
struct SpaceChanges {
  bool begins_anew = false;  ///< Whether to discard all earlier cubes first.
  /// Cubes that replace earlier cubes. A cube of zeros has become unknown again.
  std::vector<SpaceCube> cubes;
  bool is_part = false;  ///< Whether more changes follow; if so, call again.
};

/// Queries of the free-space grid. Cells are cubes with an edge of space/cell_voxels voxels.
/// Surfaces are those of a mesh update, so even a plate thinner than a voxel counts. A cell becomes
/// free when all of it is in front of the surfaces measured in an image, and stays free until a
/// surface appears in it.
class KnownSpace {
 public:
  virtual ~KnownSpace() = default;

  /// Edge of a cell, in metres.
  virtual double cellSize_m() const = 0;

  /// Cell that contains a point. @pre The point lies within the coordinate range of a map.
  Vec3i cellAt(const Eigen::Vector3d& p_W) const {
    const Eigen::Vector3d cell = (p_W / cellSize_m()).array().floor();
    return {static_cast<int32_t>(cell.x()), static_cast<int32_t>(cell.y()),
            static_cast<int32_t>(cell.z())};
  }

  /// State of a cell.
  virtual CellState stateOf(const Vec3i& cell) const = 0;

  /// Cubes with known cells that overlap the layers of cells from `first_z` to `last_z`, inclusive,
  /// in no particular order.
  virtual std::vector<SpaceCube> cubes(int32_t first_z, int32_t last_z) const = 0;

  /// Exact squared distance, in cells, from the centre of a cell to that of the nearest surface
  /// cell; -1 if there is no surface within space/max_distance_m; 0 if the distance cannot be read
  /// from disk.
  virtual int squaredDistance(const Vec3i& cell) const = 0;

  /// Distance at a point, interpolated between the centres of the cells around it. A point that is
  /// not finite or lies outside the coordinate range of a map is unknown.
  virtual SpaceDistance distanceAt(const Eigen::Vector3d& p_W) const = 0;
};

/// The free-space grid of a map, with surfaces as of the last finished mesh update and distances as
/// of the last updateDistances(). Owned by its mapper. Not thread safe.
class Space : public KnownSpace {
 public:
  /// All free and surface cells, in canonical order.
  virtual std::vector<SpaceCell> cells() const = 0;

  /// Cubes that may have changed since the last call, in no particular order. The first call, and
  /// any call with `all`, returns all cubes. Large changes are split into parts: see
  /// SpaceChanges::is_part.
  virtual SpaceChanges takeChanges(bool all = false) = 0;

  /// Recomputes the distances near surfaces that appeared or disappeared since the last call.
  /// Distances cost nothing if this is never called.
  virtual void updateDistances() = 0;

  /// Memory used by the cells and distances, in bytes.
  virtual size_t bytes() const = 0;
};

}  // namespace dtsdf
