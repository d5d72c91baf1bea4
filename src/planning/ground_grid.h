/// What planners make of space: a grid of the ground, and distances in a plane.
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

// Distances to surfaces in a plane across the map, cell by cell.

/// A cell of which something is known, and the distance where the plane meets its middle.
struct SliceCell {
  Vec3i cell;
  CellState state;  ///< Never kUnknown.
  float distance_m;
};

/// The known cells at a height along z of the map frame; in no order.
std::vector<SliceCell> sliceAt(const KnownSpace& space, double height_m);

/// Where the slice meets the middle of a cell.
Eigen::Vector3d pointInSlice(const SliceCell& cell, double cell_size_m, double height_m);

/// Columns from min() up to and with max(), counted as cells are.
using GridBox = Eigen::AlignedBox<int32_t, 2>;

/// How many along x and y. @pre The box is not empty.
inline Eigen::Vector2i sizeOf(const GridBox& box) { return box.sizes() + Eigen::Vector2i::Ones(); }

/// Values of columns: nav_msgs/OccupancyGrid has the same.
constexpr int8_t kColumnOccupied = 100;  ///< A surface is in it.
constexpr int8_t kColumnFree = 0;        ///< None is, and enough of its cells were seen free.
constexpr int8_t kColumnUnknown = -1;    ///< Neither.

/// The map as a robot on level ground sees it: of each column of cells between two heights, whether
/// anything stands in it. And what of that followers lack. The columns, and the window of them that
/// followers have: the last whole grid. Its edges lie on multiples of kStep cells; where something
/// becomes known beyond them, a whole grid of a new window is sent. All else are updates: boxes
/// inside the window, with everything in them that has changed since the window was sent first. So
/// a follower that reads only the last of several updates has missed nothing.
class GroundGrid {
 public:
  static constexpr int32_t kStep = 256;
  /// Columns that a grid may have: 256 MB.
  static constexpr size_t kMostColumns = size_t{1} << 28;

  /// Heights along z of the map frame, which has to be level, in metres, and the share of a
  /// column's cells that were seen free where it counts so.
  GroundGrid(double min_m, double max_m, double seen_share)
      : min_m_(min_m), max_m_(max_m), seen_share_(seen_share) {}

  /// Takes over what has become known. Cells may be of another size where it begins anew.
  void apply(const SpaceChanges& changes, double cell_size_m);

  /// What followers are to be sent next.
  enum class Pending {
    kNothing,
    kGrid,    ///< All of the window, which is another one than before.
    kUpdate,  ///< What has changed in the window.
  };
  /// What followers lack; is to be sent before it is asked for again.
  Pending next();

  /// The window of all that is known, where next() found it to be more than a message can hold; the
  /// one that followers have stays, and is sent on.
  const std::optional<GridBox>& tooLarge() const { return too_large_; }

  /// The window; none before the first whole grid was sent.
  const std::optional<GridBox>& window() const { return window_; }

  /// All that has changed in the window since it was sent first.
  const GridBox& changed() const { return changed_; }

  /// Row by row, x fastest.
  std::vector<int8_t> values(const GridBox& box) const;

  double cellSize_m() const { return cell_size_m_; }
  size_t bytes() const;

 private:
  static constexpr int kSide = SpaceCube::kSide;

  /// The cubes above each other, as far as they lie between the heights, and the values of their
  /// columns, as bits of a word.
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
  std::optional<GridBox> outgrownTo();

  double min_m_, max_m_, seen_share_;
  double cell_size_m_ = 0.0;                  ///< 0: nothing has come yet.
  int32_t first_layer_ = 0, last_layer_ = 0;  ///< Layers of cells that reach between the heights.
  int least_free_ = 0;                        ///< Cells of a column that have to be free.
  std::unordered_map<uint64_t, Stack> stacks_;
  std::optional<GridBox> window_, too_large_;
  GridBox changed_;
  bool is_outdated_ = false;  ///< Something has changed since the last answer of next().
  bool is_outgrown_ = false;  ///< Something may be known that lies outside of the window.
};

/// The least window around a box.
GridBox windowAround(const GridBox& known);

}  // namespace dtsdf
