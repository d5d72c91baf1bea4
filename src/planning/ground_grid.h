/// What planners make of space: a grid of the ground, and distances in a plane.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
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

/// Columns from (x, y) on, counted as cells are.
struct GridBox {
  int32_t x = 0, y = 0;
  int32_t width = 0, height = 0;

  bool isEmpty() const { return width == 0 || height == 0; }
  size_t size() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  bool contains(const GridBox& other) const;
  bool operator==(const GridBox& other) const {
    return x == other.x && y == other.y && width == other.width && height == other.height;
  }
};

/// The least box with both; an empty one counts for nothing.
GridBox unite(const GridBox& a, const GridBox& b);
GridBox intersect(const GridBox& a, const GridBox& b);

/// Values of columns: nav_msgs/OccupancyGrid has the same.
constexpr int8_t kColumnOccupied = 100;  ///< A surface is in it.
constexpr int8_t kColumnFree = 0;        ///< None is, and enough of its cells were seen free.
constexpr int8_t kColumnUnknown = -1;    ///< Neither.

/// Heights along z of the map frame, which has to be level, in metres.
struct GroundHeights {
  double min_m, max_m;
  double seen_share = 1.0;  ///< Of a column's cells: so many were seen free where it counts so.
};

/// The cells that reach into what lies between two heights: a column is these.
struct CellLayers {
  int32_t first, last;
  int count() const { return last - first + 1; }
};
CellLayers layersBetween(const GroundHeights& heights, double cell_size_m);

/// The values of all columns, kept up to date cube by cube.
class GroundColumns {
 public:
  GroundColumns(const GroundHeights& heights, double cell_size_m)
      : layers_(layersBetween(heights, cell_size_m)),
        least_free_(std::max(
            1, static_cast<int>(std::ceil(heights.seen_share * layers_.count() - 1e-6)))) {}

  /// Takes a cube over as it is now. @return the columns whose values have changed by that.
  GridBox put(const SpaceCube& cube);

  int8_t at(int32_t x, int32_t y) const;

  /// Row by row, x fastest.
  std::vector<int8_t> values(const GridBox& box) const;

  /// The least box with all columns that are not unknown.
  GridBox known() const;

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
  GridBox evaluate(int32_t stack_x, int32_t stack_y, Stack& stack) const;

  CellLayers layers_;
  int least_free_;  ///< Cells of a column that have to be free.
  std::unordered_map<uint64_t, Stack> stacks_;
};

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

  explicit GroundGrid(const GroundHeights& heights) : heights_(heights) {}

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

  std::vector<int8_t> values(const GridBox& box) const;

  double cellSize_m() const { return cell_size_m_; }
  size_t bytes() const { return columns_ ? columns_->bytes() : 0; }

 private:
  void beginAnew(double cell_size_m);
  void note(const GridBox& columns);
  std::optional<GridBox> outgrownTo();

  GroundHeights heights_;
  double cell_size_m_ = 0.0;
  std::optional<GroundColumns> columns_;
  std::optional<GridBox> window_, too_large_;
  GridBox changed_;
  bool is_outdated_ = false;  ///< Something has changed since the last answer of next().
  bool is_outgrown_ = false;  ///< Something may be known that lies outside of the window.
};

/// The least window around a box.
GridBox windowAround(const GridBox& known);

}  // namespace dtsdf
