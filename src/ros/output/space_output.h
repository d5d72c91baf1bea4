/// What leaves of space: the grid of the ground and its updates, slices of distances, and what
/// planners ask for.
#pragma once

#include <ros/time.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <vector>

#include "params/node_params.h"
#include "ros/common/schedule.h"
#include "ros/output/handovers.h"
#include "ros/output/reports.h"
#include "ros/output/space_publishers.h"
#include "space/space_follower.h"

namespace dtsdf {

/// What is known of space.
struct StampedSpace {
  std::shared_ptr<const SpaceSnapshot> space;  ///< Never null.
  ros::Time stamp;                             ///< See SpaceDelivery.
};

/// On a thread of its own, but for newest() and addTo(): neither the map waits for it, nor it for a
/// mesh that is saved.
class SpaceOutput {
 public:
  /// `handover` outlives it.
  SpaceOutput(const ros::NodeHandle& nh, const MappingParams& params, SpaceHandover& handover);

  void setRate(double rate_hz) { pace_.setRate(rate_hz, std::chrono::steady_clock::now()); }

  /// Takes over what has become known, and publishes what is due. Returns how long there will be
  /// nothing to do.
  std::chrono::milliseconds step() noexcept;

  /// After it, nothing is answered or published of the map as it was before it was cleared last.
  void takeChanges();

  /// What is known now, as of the last mesh update: waits for nobody. Any thread.
  StampedSpace newest() const;

  /// Adds its topics and memory. Any thread.
  void addTo(OutputReport& report) const;

 private:
  void work();
  void meetListeners();
  void publish();
  void keep(const ros::Time& stamp);

  SpaceHandover& handover_;
  const double slice_height_m_;
  SpaceFollower follower_;
  GridPublisher grid_;
  SlicePublisher slice_;
  Pace pace_;
  bool is_outdated_ = false;  ///< What was published last,
  bool is_another_ =
      false;  ///< and listeners are not to wait: it is of another map, or they are new.
  bool has_grid_listeners_ = false, has_slice_listeners_ = false;

  mutable std::mutex mutex_;  ///< Guards what follows, for a moment.
  StampedSpace newest_{std::make_shared<const SpaceSnapshot>(), {}};
  std::vector<TopicStatus> topics_;
  size_t bytes_ = 0;
  PagedValues::Stats pages_;
};

}  // namespace dtsdf
