/// The step of space: the grid of the ground and its updates, slices of distances, and what
/// planners ask for.
#pragma once

#include <ros/node_handle.h>
#include <ros/time.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "dtsdf_mapping/space.h"
#include "kernels/core/grid.h"
#include "planning/ground_grid.h"
#include "ros/common/pace.h"
#include "ros/common/topic.h"
#include "ros/steps/step.h"
#include "space/space_follower.h"

namespace dtsdf {

/// The queue from the map's thread to the output's: what has become known. Thread safe. Changes of
/// one cube become one, so that an output that stands still costs the cells of the map once and no
/// more.
class SpaceQueue {
 public:
  struct Delivery {
    SpaceChanges changes;
    double cell_size_m = 0.0;
    /// Of the newest frame whose surfaces are in it; cells may be free by later ones. 0: none was
    /// fused, as in a map that was loaded.
    ros::Time stamp;
  };

  void add(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp);
  /// Whether so much waits that more is better handed over later.
  bool isFull() const;
  /// The map has become another one, or empty: drops what waits, and has the output forget all.
  void clear();
  /// Nothing, if nothing has changed.
  std::optional<Delivery> take();

 private:
  mutable std::mutex mutex_;
  bool has_changes_ = false;
  Delivery waiting_;  ///< Without its cubes.
  std::unordered_map<PackedKey, SpaceCube> cubes_;
};

/// When an update of the grid may be published, so that costmap_2d's StaticLayer, as it is, never
/// shows a wrong grid.
///
/// That layer adds an update to the last grid without a look at bounds, and gets both by
/// connections of their own: an update that overtook its grid would write beside it. And of what
/// comes between two of its cycles it hands on the place of the last message only: an update soon
/// after a grid would hide the rest of the grid. So an update is published a moment after the grid
/// that it is counted from; and for some cycles after a grid, updates are all of it.
class StaticLayerPace {
 public:
  /// An update is published no sooner after a grid.
  static constexpr std::chrono::milliseconds kGap{200};
  /// For so long after a grid, updates are all of it.
  static constexpr std::chrono::milliseconds kSettling{2000};

  /// A grid is published now.
  void startOver(SteadyTime now) {
    lacks_ = true;
    not_before_ = now + kGap;
    whole_until_ = now + kSettling;
  }

  /// Something has changed since.
  void noteChange() { lacks_ = true; }

  bool isDue(SteadyTime now) const { return lacks_ && now >= not_before_; }

  /// The update that is due is published. @return whether it has to be all of the grid.
  bool takeUpdate(SteadyTime now) {
    lacks_ = false;
    return now < whole_until_;
  }

 private:
  bool lacks_ = false;
  SteadyTime not_before_, whole_until_;
};

/// With space/enabled. Its queries wait for nobody.
class SpaceStep : public Step {
 public:
  explicit SpaceStep(const Host& host);

  void advertise(const Handles& handles) override;
  std::optional<double> meshRate_hz() const override;
  void meshed() override { handOver(); }
  void replaced(const Replacement& replacement) override;
  Work hasWork() const override;
  void work() override { handOver(); }
  SteadyDuration publish(ShownMesh*) override;
  void fill(dtsdf_mapping::MapStatus& status) override;

  struct Known {
    std::shared_ptr<const SpaceSnapshot> space = std::make_shared<const SpaceSnapshot>();
    ros::Time stamp;  ///< See SpaceQueue::Delivery.
  };
  Known known() const;

 private:
  void handOver();
  void takeChanges();
  void meetListeners();
  void renew(SteadyTime now);
  void publishGrid(SteadyTime now);
  void publishUpdate(SteadyTime now);
  void publishSlice();

  const Host& host_;
  const bool is_on_;

  // Map's thread.
  bool is_part_ = false;  ///< There is more to be handed over.
  SpaceQueue queue_;

  // Output's thread.
  std::unique_ptr<SpaceFollower> follower_;
  std::optional<GroundGrid> grid_;  ///< While somebody listens to it.
  bool is_grid_due_ = false, is_outdated_ = false;
  bool is_another_ = false;  ///< Listeners are not to wait: it is of another map, or they are new.
  StaticLayerPace update_pace_;
  Pace pace_;
  Topic grids_, updates_, slices_;
  ros::ServiceServer server_;

  mutable std::mutex mutex_;  ///< Guards what follows, for a moment.
  Known known_;
  size_t bytes_ = 0;
  PagedValues::Stats pages_;
};

}  // namespace dtsdf
