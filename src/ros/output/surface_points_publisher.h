/// Publishes the vertices of the mesh as a point cloud, while someone listens.
#pragma once

#include <ros/node_handle.h>

#include <atomic>
#include <string>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// Output's thread only, but for hasListeners(); subscriptions are noticed on the queue of the node
/// handle.
class SurfacePointsPublisher {
 public:
  SurfacePointsPublisher(ros::NodeHandle nh, const std::string& map_frame, MeshColour colour);

  bool hasListeners() const { return publisher_.getNumSubscribers() > 0; }

  void noteChanges() { outdated_ = true; }

  /// Someone listens who has not seen the present mesh.
  bool isDue() const { return outdated_ && hasListeners(); }
  void publish(const Mesh& mesh, const ros::Time& stamp);

 private:
  std::string map_frame_;
  MeshColour colour_;
  std::atomic<bool> outdated_{true};
  ros::Publisher publisher_;
};

}  // namespace dtsdf
