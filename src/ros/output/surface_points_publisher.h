/// Publishes the vertices of the mesh as a point cloud, while someone listens.
#pragma once

#include <ros/node_handle.h>

#include <string>

#include "dtsdf_mapping/mesh.h"
#include "ros/output/listener_topic.h"

namespace dtsdf {

/// Output's thread only, but for listeners(). A cloud is the whole mesh, so that
/// a listener gets the next one when it has read the one before.
class SurfacePointsPublisher {
 public:
  SurfacePointsPublisher(const ros::NodeHandle& nh, const std::string& map_frame,
                         MeshColour colour);

  size_t listeners() const { return topic_.listeners(); }

  void noteChanges() { topic_.outdate(); }

  /// Someone listens who has not seen the present mesh, and has read what was sent before.
  bool isDue();
  void publish(const Mesh& mesh, const ros::Time& stamp);

  TopicStatus report() const { return topic_.report(); }

 private:
  std::string map_frame_;
  MeshColour colour_;
  ListenerTopic topic_;
};

}  // namespace dtsdf
