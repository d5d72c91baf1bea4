/// Publishes distances to surfaces at one height as a point cloud, while someone listens.
#pragma once

#include <ros/node_handle.h>

#include <optional>
#include <string>
#include <vector>

#include "planning/distance_slice.h"
#include "ros/output/listener_topic.h"

namespace dtsdf {

/// Distances in a plane.
struct SpaceSlice {
  std::vector<SliceCell> cells;
  double cell_size_m = 0.0;
  ros::Time stamp;  ///< See SpaceDelivery.
};

/// Space's thread only, but for listeners(). A listener gets the newest slice when it has read the
/// one before.
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

  TopicReport report() const { return topic_.report(); }

 private:
  const std::string map_frame_;
  const double height_m_;
  ListenerTopic topic_;
  std::optional<ros::SerializedMessage> newest_;
};

}  // namespace dtsdf
