/// The queue from the map's thread to that of space: what has become known.
#pragma once

#include <ros/time.h>

#include <functional>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dtsdf_mapping/space.h"
#include "kernels/core/grid.h"

namespace dtsdf {

/// What has become known since it was last taken.
struct SpaceDelivery {
  SpaceChanges changes;
  double cell_size_m = 0.0;
  /// Of the newest frame whose surfaces are in it; cells may be free by later ones. 0: none was
  /// fused, as in a map that was loaded.
  ros::Time stamp;
};

/// What leads from what was known before to what is known now: all cubes of which something is.
SpaceChanges changesBetween(const KnownSpace& before, std::vector<SpaceCube> now);

/// Thread safe. Changes of one cube become one, so that an output that stands still costs the cells
/// of the map once and no more.
class SpaceHandover {
 public:
  /// `on_change` is called after each change, by the thread that made it.
  explicit SpaceHandover(std::function<void()> on_change) : on_change_(std::move(on_change)) {}

  void add(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp);

  /// Whether so much waits that more is better handed over later.
  bool isFull() const;

  /// The map has become another one, or empty: drops what waits, and has the output forget all.
  void clear();

  /// Nothing, if nothing has changed.
  std::optional<SpaceDelivery> take();

 private:
  std::function<void()> on_change_;
  mutable std::mutex mutex_;
  bool has_changes_ = false, begins_anew_ = false;
  std::unordered_map<PackedKey, SpaceCube> cubes_;
  double cell_size_m_ = 0.0;
  ros::Time stamp_;
};

}  // namespace dtsdf
