/// Subscribes to the mesh topic and maintains the set of markers that RViz would display.
#pragma once

#include <ros/node_handle.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <map>

namespace dtsdf {

class MeshWatcher {
 public:
  explicit MeshWatcher(ros::NodeHandle nh);

  /// The displayed markers, indexed by ID.
  const std::map<int, visualization_msgs::Marker>& shown() const { return shown_; }
  size_t triangles() const;

  uint64_t addedMarkers() const { return added_; }
  uint64_t deletedMarkers() const { return deleted_; }

 private:
  void onMarkers(const visualization_msgs::MarkerArray::ConstPtr& message);

  std::map<int, visualization_msgs::Marker> shown_;
  uint64_t added_ = 0, deleted_ = 0;
  ros::Subscriber subscriber_;
};

}  // namespace dtsdf
