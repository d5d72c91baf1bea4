/// Publishes the map as a grid of the ground, and what changes in it, for costmap_2d's StaticLayer
/// as it is and whoever does likewise.
///
/// That layer adds an update to the last grid without a look at bounds, gets both by connections of
/// their own, and of what comes between two of its cycles it hands on the place of the last message
/// only. So an update is sent a moment after the grid that it is counted from, when that has been
/// read; and for some cycles after a grid, updates are all of it.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "planning/ground_grid.h"
#include "ros/common/steady_clock.h"
#include "ros/output/listener_topic.h"

namespace dtsdf {

/// Space's thread only, but for listeners().
class GridPublisher {
 public:
  /// An update is sent no sooner after a grid.
  static constexpr std::chrono::milliseconds kGap{200};
  /// For so long after a grid, updates are all of it.
  static constexpr std::chrono::milliseconds kSettling{2000};

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
  std::vector<TopicReport> report() const { return {grids_.report(), updates_.report()}; }

 private:
  using Link = std::shared_ptr<ListenerLink>;

  /// What a listener to updates lacks.
  struct Follower {
    bool lacks = true;
    SteadyTime not_before, whole_until;
  };

  void meetListeners(SteadyTime now);
  void startOver(Follower& follower, SteadyTime now) const;
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
  std::set<Link> have_grid_;            ///< The one of the window that is.
  std::map<Link, Follower> followers_;  ///< Of updates.
};

}  // namespace dtsdf
