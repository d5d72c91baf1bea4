/// Publishes what is known of space, to those who listen: the map as a grid of the ground with its
/// updates, and distances to surfaces at one height.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planning/ground_grid.h"
#include "ros/common/schedule.h"
#include "ros/output/listener_topic.h"

namespace dtsdf {

/// When a reader of occupancy_grid_updates may get one, so that costmap_2d's StaticLayer, as it is,
/// never shows a wrong grid.
///
/// That layer adds an update to the last grid without a look at bounds, and gets both by
/// connections of their own: an update that overtook its grid would write beside it. And of what
/// comes between two of its cycles it hands on the place of the last message only: an update soon
/// after a grid would hide the rest of the grid. So an update is sent a moment after the grid that
/// it is counted from; and for some cycles after a grid, updates are all of it. Whoever does
/// likewise is served by this, too; whoever reads with more care loses nothing.
class StaticLayerPace {
 public:
  /// An update is sent no sooner after a grid.
  static constexpr std::chrono::milliseconds kGap{200};
  /// For so long after a grid, updates are all of it.
  static constexpr std::chrono::milliseconds kSettling{2000};

  /// The reader is new, or gets a grid now.
  void startOver(SteadyTime now) {
    lacks_ = true;
    not_before_ = now + kGap;
    whole_until_ = now + kSettling;
  }

  /// Something has changed that the reader lacks.
  void noteChange() { lacks_ = true; }

  bool isDue(SteadyTime now) const { return lacks_ && now >= not_before_; }

  /// The update that is due is sent. @return whether it has to be all of the grid.
  bool takeUpdate(SteadyTime now) {
    lacks_ = false;
    return now < whole_until_;
  }

 private:
  bool lacks_ = true;
  SteadyTime not_before_, whole_until_;
};

/// Publishes the map as a grid of the ground, and what changes in it, to those who listen to
/// either. When a reader of updates gets one is StaticLayerPace's. Space's thread only, but for
/// listeners().
class GridPublisher {
 public:
  GridPublisher(const ros::NodeHandle& nh, const std::string& map_frame,
                const GroundHeights& heights);

  size_t listeners() const { return grids_.listeners() + updates_.listeners(); }

  /// Takes over what has become known.
  void apply(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp);

  /// Forgets the grid, which nobody listens to.
  void forget();

  /// From now on listeners lack what has become known.
  void renew(SteadyTime now);

  /// Sends what listeners lack and have room for.
  void serve(SteadyTime now);

  size_t bytes() const { return grid_.bytes(); }
  std::vector<TopicStatus> report() const { return {grids_.report(), updates_.report()}; }

 private:
  using Link = std::shared_ptr<ListenerLink>;

  void serveGrids(SteadyTime now);
  void serveUpdates(SteadyTime now);
  bool isBusy(const ListenerTopic::Links& links, const std::string& name) const;
  ros::SerializedMessage gridMessage() const;
  ros::SerializedMessage updateMessage(const GridBox& box) const;

  const std::string map_frame_;
  const GroundHeights heights_;
  GroundGrid grid_;
  ros::Time stamp_;
  ListenerTopic grids_, updates_;
  std::map<Link, StaticLayerPace> followers_;  ///< Of updates.
};

/// Distances in a plane.
struct SpaceSlice {
  std::vector<SliceCell> cells;
  double cell_size_m = 0.0;
  ros::Time stamp;  ///< See SpaceDelivery.
};

/// Publishes distances to surfaces at one height as a point cloud, while someone listens. Space's
/// thread only, but for listeners(). A listener gets the newest slice when it has read the one
/// before.
class SlicePublisher {
 public:
  SlicePublisher(const ros::NodeHandle& nh, const std::string& map_frame, double height_m);

  size_t listeners() const { return topic_.listeners(); }

  /// Lets everyone have it.
  void put(const SpaceSlice& slice);

  /// Forgets the slice, which nobody listens to.
  void forget() { newest_.reset(); }

  /// Sends it to those who lack it and have room for it.
  void serve();

  TopicStatus report() const { return topic_.report(); }

 private:
  const std::string map_frame_;
  const double height_m_;
  ListenerTopic topic_;
  std::optional<ros::SerializedMessage> newest_;
};

}  // namespace dtsdf
