/// Publishes the mesh in chunks: to everyone what changed, to a newcomer everything.
#pragma once

#include <ros/node_handle.h>

#include <functional>
#include <set>
#include <string>

#include <visualization_msgs/MarkerArray.h>

#include "ros/output/mesh_chunks.h"

namespace dtsdf {

/// Output's thread only, but for hasListeners(), listeners() and the callback, which is called by
/// the queue of the node handle.
class MeshPublisher {
 public:
  using OnNewcomer = std::function<void(const ros::SingleSubscriberPublisher&)>;

  struct Style {
    std::string map_frame;
    MeshColour colour = MeshColour::kAuto;
    int chunk_blocks = 4;
  };

  /// `on_newcomer` has to bring about publishAll() before it returns: the publisher for a single
  /// subscriber that it is given lives no longer.
  MeshPublisher(ros::NodeHandle nh, const Style& style, OnNewcomer on_newcomer);

  bool hasListeners() const { return publisher_.getNumSubscribers() > 0; }
  size_t listeners() const { return publisher_.getNumSubscribers(); }
  bool hasChanges() const { return !chunks_.changed().empty(); }

  void noteChange(const BlockKey& block) { chunks_.markChanged(block); }
  void noteCleared() { chunks_.markAllChanged(); }

  void publishChanges(const MeshStore& mesh);
  void publishAll(const MeshStore& mesh, const ros::SingleSubscriberPublisher& newcomer);

 private:
  visualization_msgs::Marker makeMarker(const MeshStore& mesh, PackedKey chunk) const;

  Style style_;
  MeshChunks chunks_;
  std::set<PackedKey> shown_;  ///< Chunks that a subscriber may have on display.
  ros::Publisher publisher_;
};

}  // namespace dtsdf
