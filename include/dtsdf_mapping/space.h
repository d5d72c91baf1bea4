/// Space for planners: which cells are free, unknown or contain a surface, and the distance to the
/// nearest surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// What is known of a cell.
enum class CellState : unsigned char {
  kUnknown,  ///< Neither of the following.
  kFree,     ///< An image saw through all of it, and it contains no surface.
  kSurface,  ///< A surface of the mesh passes through it, whichever way it faces.
};

/// The distance from a point to the nearest surface.
struct SpaceDistance {
  bool known = false;  ///< Whether the point's cell is free, or has a surface.
  /// To the nearest surface, in metres; negative if the point's cell is unknown. Its magnitude is
  /// at most space/max_distance_m, rounded up to whole cells.
  float distance_m = 0.0f;
  /// Gradient of distance_m, per axis of W; 0 at the largest distance. If `known`, it points
  /// towards more room; if not, as distance_m is negative, to the nearest surface.
  Vec3f gradient{};
};

/// A cell, and what is known of it.
struct SpaceCell {
  Vec3i cell;       ///< Reaches from `cell` to `cell` + 1, times cellSize_m(), in W.
  CellState state;  ///< Never kUnknown.
};

/// What is known of 8 x 8 x 8 cells at once. Of a mask's word z, bit x + 8 y is the cell
/// `first` + (x, y, z).
struct SpaceCube {
  static constexpr int kSideLog2 = 3;           ///< Binary logarithm of kSide.
  static constexpr int kSide = 1 << kSideLog2;  ///< Cells along an edge.
  using Mask = std::array<uint64_t, kSide>;     ///< A bit for each cell.

  Vec3i first;   ///< The lowest of its cells; a multiple of kSide per axis.
  Mask free;     ///< Free cells.
  Mask surface;  ///< Surface cells.

  /// The cube that a cell is in, counted in cubes.
  static Vec3i cubeOf(const Vec3i& cell) {
    return {cell.x >> kSideLog2, cell.y >> kSideLog2, cell.z >> kSideLog2};
  }
  /// The bit of a cell in its word of a mask.
  static int bitOf(int32_t x, int32_t y) { return (x & (kSide - 1)) + kSide * (y & (kSide - 1)); }
  /// The cell of a bit in word `z`.
  Vec3i cellOf(int32_t z, int bit) const {
    return {first.x + bit % kSide, first.y + bit / kSide, first.z + z};
  }
  /// What is known of one of its cells.
  CellState stateOf(const Vec3i& cell) const {
    const auto word = static_cast<std::size_t>(cell.z - first.z);
    const uint64_t bit = uint64_t{1} << bitOf(cell.x, cell.y);
    if ((surface[word] & bit) != 0) return CellState::kSurface;
    return (free[word] & bit) != 0 ? CellState::kFree : CellState::kUnknown;
  }
};

/// Changes of space.
struct SpaceChanges {
  bool begins_anew = false;      ///< First forget everything known so far.
  std::vector<SpaceCube> cubes;  ///< These replace the cubes before; all zeros: unknown again.
  bool is_part = false;          ///< There is more: call again.
};

/// Queries of space. Cells are cubes of space/cell_voxels voxels. Surfaces are those of a mesh
/// update, so that even a plate thinner than a voxel is one. A cell is free if an image saw through
/// all of it; it stays free until a surface appears in it.
class KnownSpace {
 public:
  virtual ~KnownSpace() = default;

  /// Edge of a cell, in metres.
  virtual double cellSize_m() const = 0;

  /// The cell that a point is in. @pre The point lies within the coordinates of a map.
  Vec3i cellAt(const Eigen::Vector3d& p_W) const {
    const Eigen::Vector3d cell = (p_W / cellSize_m()).array().floor();
    return {static_cast<int32_t>(cell.x()), static_cast<int32_t>(cell.y()),
            static_cast<int32_t>(cell.z())};
  }

  /// What is known of a cell.
  virtual CellState stateOf(const Vec3i& cell) const = 0;

  /// Cubes that have cells from `first_z` to `last_z`, both included, and some cell of which is not
  /// unknown; in no particular order.
  virtual std::vector<SpaceCube> cubes(int32_t first_z, int32_t last_z) const = 0;

  /// Squared distance, in cells, from a cell's centre to that of the nearest surface cell, exact;
  /// -1 if there is none within space/max_distance_m.
  virtual int squaredDistance(const Vec3i& cell) const = 0;

  /// The distance at a point, interpolated between the centres of the cells around it. Points that
  /// are not finite, or beyond the coordinates of a map, are unknown.
  virtual SpaceDistance distanceAt(const Eigen::Vector3d& p_W) const = 0;
};

/// The space of a map, as of the last finished mesh update. Distances are those of the last
/// updateDistances(). Belongs to its mapper, and is no more thread safe than that.
class Space : public KnownSpace {
 public:
  /// All cells that are not unknown, in canonical order.
  virtual std::vector<SpaceCell> cells() const = 0;

  /// What may have changed since the last call, in no particular order. At the first call, and with
  /// `all`, that is everything. Large changes come in parts: see SpaceChanges::is_part.
  virtual SpaceChanges takeChanges(bool all = false) = 0;

  /// Updates the distances: recomputes those within reach of surfaces that appeared or vanished
  /// since the last call. Distances cost nothing if this is never called.
  virtual void updateDistances() = 0;

  /// Memory in bytes, distances included.
  virtual size_t bytes() const = 0;
};

}  // namespace dtsdf
