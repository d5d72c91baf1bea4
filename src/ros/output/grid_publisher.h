/// Publishes the map as a grid of the ground, and what changes in it, to those who listen to
/// either. When a reader of updates gets one is StaticLayerPace's.
#pragma once

#include <ros/node_handle.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "planning/ground_grid.h"
#include "ros/common/steady_clock.h"
#include "ros/output/listener_topic.h"
#include "ros/output/static_layer_pace.h"

namespace dtsdf {

/// Space's thread only, but for listeners().
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
  std::vector<TopicReport> report() const { return {grids_.report(), updates_.report()}; }

 private:
  using Link = std::shared_ptr<ListenerLink>;

  void meetListeners(SteadyTime now);
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

}  // namespace dtsdf
