/// Space for planners: whether a cell is free, unknown or contains a surface, and the distance to
/// the nearest surface.
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
  kUnknown,  ///< Neither free nor a surface cell.
  kFree,     ///< An image looked through all of it, and it contains no surface.
  kSurface,  ///< A surface of the mesh passes through it, facing either way.
};

/// The distance from a point to the nearest surface.
struct SpaceDistance {
  bool known = false;  ///< Whether the point's cell is free or has a surface.
  /// Distance to the nearest surface in metres, negative if the point's cell is unknown. Its
  /// magnitude is at most space/max_distance_m, rounded up to whole cells.
  float distance_m = 0.0f;
  /// Gradient of distance_m along the axes of W; 0 at the maximum distance. If `known`, it points
  /// away from the nearest surface, otherwise towards it, since distance_m is then negative.
  Vec3f gradient{};
};

/// A cell and its state.
struct SpaceCell {
  Vec3i cell;       ///< The cell spans `cell` to `cell` + 1, times cellSize_m(), in W.
  CellState state;  ///< Never kUnknown.
};

/// States of 8 x 8 x 8 cells. Bit x + 8 y of word z of a mask stands for the cell `first` + (x, y,
/// z).
struct SpaceCube {
  static constexpr int kSideLog2 = 3;           ///< Binary logarithm of kSide.
  static constexpr int kSide = 1 << kSideLog2;  ///< Cells along an edge.
  using Mask = std::array<uint64_t, kSide>;     ///< A bit for each cell.

  Vec3i first;   ///< Lowest cell; a multiple of kSide per axis.
  Mask free;     ///< Free cells.
  Mask surface;  ///< Surface cells.

  /// Coordinates, in cubes, of the cube that contains a cell.
  static Vec3i cubeOf(const Vec3i& cell) {
    return {cell.x >> kSideLog2, cell.y >> kSideLog2, cell.z >> kSideLog2};
  }
  /// Bit of a cell in its word of a mask.
  static int bitOf(int32_t x, int32_t y) { return (x & (kSide - 1)) + kSide * (y & (kSide - 1)); }
  /// Cell of a bit in word `z`.
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

/// Changes to space.
struct SpaceChanges {
  bool begins_anew = false;      ///< Discard all earlier cubes first.
  std::vector<SpaceCube> cubes;  ///< Cubes that replace earlier ones; a cube of zeros is unknown
                                 ///< again.
  bool is_part = false;          ///< More changes follow: call again.
};

/// Space queries. Cells are cubes with an edge of space/cell_voxels voxels. Surfaces are those of a
/// mesh update, so even a plate thinner than a voxel counts. A cell is free once an image has
/// looked through all of it, until a surface appears in it.
class KnownSpace {
 public:
  virtual ~KnownSpace() = default;

  /// Edge of a cell, in metres.
  virtual double cellSize_m() const = 0;

  /// Cell that contains a point. @pre The point lies within the coordinates of a map.
  Vec3i cellAt(const Eigen::Vector3d& p_W) const {
    const Eigen::Vector3d cell = (p_W / cellSize_m()).array().floor();
    return {static_cast<int32_t>(cell.x()), static_cast<int32_t>(cell.y()),
            static_cast<int32_t>(cell.z())};
  }

  /// State of a cell.
  virtual CellState stateOf(const Vec3i& cell) const = 0;

  /// Cubes that have known cells and overlap the layers of cells from `first_z` to `last_z`, both
  /// included, in no particular order.
  virtual std::vector<SpaceCube> cubes(int32_t first_z, int32_t last_z) const = 0;

  /// Exact squared distance, in cells, from the centre of a cell to that of the nearest surface
  /// cell; -1 if no surface is within space/max_distance_m; 0 if the distance cannot be read from
  /// disk.
  virtual int squaredDistance(const Vec3i& cell) const = 0;

  /// Distance at a point, interpolated between the centres of the cells around it. A point that is
  /// not finite or lies outside the coordinates of a map is unknown.
  virtual SpaceDistance distanceAt(const Eigen::Vector3d& p_W) const = 0;
};

/// The space of a map: surfaces as of the last finished mesh update, distances as of the last
/// updateDistances(). Owned by its mapper and, like it, not thread safe.
class Space : public KnownSpace {
 public:
  /// All free and surface cells, in canonical order.
  virtual std::vector<SpaceCell> cells() const = 0;

  /// Cubes that may have changed since the last call, in no particular order. The first call, and
  /// any call with `all`, returns all cubes. Large changes come in parts: see
  /// SpaceChanges::is_part.
  virtual SpaceChanges takeChanges(bool all = false) = 0;

  /// Recomputes the distances near surfaces that appeared or vanished since the last call.
  /// Distances cost nothing if this is never called.
  virtual void updateDistances() = 0;

  /// Memory in bytes, including the distances.
  virtual size_t bytes() const = 0;
};

}  // namespace dtsdf
