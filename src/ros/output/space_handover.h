/// The queue from the map's thread to the output's for what is known of space: the one says what it
/// wants, the other what there is.
#pragma once

#include <ros/time.h>

#include <functional>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/space.h"
#include "planning/distance_slice.h"

namespace dtsdf {

/// What the output wants.
struct SpaceWish {
  bool cells = false;      ///< To follow the changes of cells,
  bool all_cells = false;  ///< and to begin with everything.
  bool slice = false;      ///< Slices,
  bool first_slice = false;  ///< also where nothing has changed.
  bool any() const { return cells || slice; }
  bool lacks() const { return all_cells || first_slice; }
};

/// Distances in a plane.
struct SpaceSlice {
  std::vector<SliceCell> cells;
  double cell_size_m = 0.0;
  ros::Time stamp;  ///< Of the newest frame whose surfaces count; cells may be free by later ones.
};

/// What has become known since it was last taken.
struct SpaceDelivery {
  std::optional<SpaceChanges> changes;
  double cell_size_m = 0.0;  ///< Of the changes.
  ros::Time stamp;           ///< The same as that of a slice.
  std::optional<SpaceSlice> slice;
};

/// Thread safe. Changes of one cube become one, so that an output that stands still costs the cells
/// of the map once and no more.
class SpaceHandover {
 public:
  /// `on_delivery` is called after each delivery, by the thread that made it. The map's thread
  /// looks for wishes by itself.
  explicit SpaceHandover(std::function<void()> on_delivery);

  /// By the output. What is not wanted any more is thrown away; when it is wanted again, it begins
  /// with everything.
  void want(bool cells, bool slice);

  /// By the map's thread.
  SpaceWish wish() const;
  void tell(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp);
  void tell(SpaceSlice slice);
  /// The map has become another one, or empty: drops what waits, and has the output forget at once
  /// what it was told before.
  void clear();

  /// By the output.
  SpaceDelivery take();

 private:
  std::function<void()> on_delivery_;
  mutable std::mutex mutex_;
  SpaceWish wish_;
  bool has_changes_ = false, begins_anew_ = false;
  std::unordered_map<PackedKey, SpaceCube> cubes_;
  double cell_size_m_ = 0.0;
  ros::Time stamp_;
  std::optional<SpaceSlice> slice_;
};

}  // namespace dtsdf
