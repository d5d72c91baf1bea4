/// The free-space grid for 2D planners: an occupancy grid of the ground, and distances in a
/// horizontal plane.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/space.h"

namespace dtsdf {

/// Returns, for each known cell that a horizontal plane intersects, x, y and z of the centre of the
/// intersection, and the distance there. All are in metres, in no particular order.
/// @param height_m Height of the plane along z of the map frame, which must be level.
std::vector<Eigen::Vector4f> sliceAt(const KnownSpace& space, double height_m);

/// Columns from min() to max(), both included, in cells.
using GridBox = Eigen::AlignedBox<int32_t, 2>;

/// Number of columns along x and y. @pre The box is not empty.
inline Eigen::Vector2i sizeOf(const GridBox& box) { return box.sizes() + Eigen::Vector2i::Ones(); }

/// Values of columns, as in nav_msgs/OccupancyGrid.
constexpr int8_t kColumnOccupied = 100;  ///< The column contains a surface.
constexpr int8_t kColumnFree = 0;  ///< It contains no surface, and enough of its cells are free.
constexpr int8_t kColumnUnknown = -1;  ///< Neither occupied nor free.

/// A grid for a robot on level ground: whether each column of cells between two heights is free or
/// occupied. The grid also keeps track of what to publish.
///
/// The window is the box of columns in the last complete grid that was sent to subscribers. Its
/// edges lie on multiples of kStep cells. When columns outside the window become known, a complete
/// grid with a new window is sent. Other changes are sent as updates. An update is a box inside the
/// window that contains all changes since the window was first sent, so a subscriber that reads
/// only the last of several updates misses nothing.
class GroundGrid {
 public:
  static constexpr int32_t kStep = 256;
  /// Maximum number of columns in a grid, which then takes 256 MiB.
  static constexpr size_t kMaxColumns = size_t{1} << 28;

  /// @param min_m, max_m Lower and upper end of the columns, in metres along z of the map frame,
  /// which must be level.
  /// @param seen_share Fraction of a column's cells that must be free for the column to be free.
  GroundGrid(double min_m, double max_m, double seen_share)
      : min_m_(min_m), max_m_(max_m), seen_share_(seen_share) {}

  /// Applies changes of the free-space grid. The cell size may change only with
  /// SpaceChanges::begins_anew.
  void apply(const SpaceChanges& changes, double cell_size_m);

  enum class Pending {
    kNothing,
    kGrid,    ///< A complete grid, with a new window.
    kUpdate,  ///< The changes in the window.
  };
  /// Returns what to send to subscribers now. Send it before the next call.
  Pending next();

  /// The window of all known columns, if next() found that it has more than kMaxColumns columns.
  /// Subscribers then keep their window and still get its updates.
  const std::optional<GridBox>& tooLarge() const { return too_large_; }

  /// The subscribers' window; none before the first complete grid.
  const std::optional<GridBox>& window() const { return window_; }

  /// Box of all changes in the window since it was first sent.
  const GridBox& changed() const { return changed_; }

  /// Values of the columns in a box, in row-major order, x fastest.
  std::vector<int8_t> values(const GridBox& box) const;

  double cellSize_m() const { return cell_size_m_; }
  size_t bytes() const;

 private:
  static constexpr int kSide = SpaceCube::kSide;

  /// Cubes on top of each other, clipped to the height range, and the values of their columns,
  /// indexed by SpaceCube::bitOf().
  struct Stack {
    std::vector<SpaceCube> parts;
    std::array<int8_t, kSide * kSide> values;
  };

  static uint64_t keyOf(int32_t stack_x, int32_t stack_y);
  void beginAnew(double cell_size_m);
  GridBox put(const SpaceCube& cube);
  GridBox evaluate(int32_t stack_x, int32_t stack_y, Stack& stack) const;
  void note(const GridBox& columns);
  GridBox known() const;
  std::optional<GridBox> grownWindow();

  double min_m_, max_m_, seen_share_;
  double cell_size_m_ = 0.0;                  ///< 0 before the first apply().
  int32_t first_layer_ = 0, last_layer_ = 0;  ///< Layers of cells in the height range.
  int min_free_ = 0;                          ///< Number of cells in a column that must be free.
  std::unordered_map<uint64_t, Stack> stacks_;
  std::optional<GridBox> window_, too_large_;
  GridBox changed_;
  bool is_outdated_ = false;  ///< Columns have changed since the last call to next().
  bool is_outgrown_ = false;  ///< Columns outside the window may be known.
};

/// Smallest window around a box.
GridBox windowAround(const GridBox& known);

}  // namespace dtsdf
