#include "ros/support/mesh_watcher.h"

namespace dtsdf {

using visualization_msgs::Marker;

MeshWatcher::MeshWatcher(ros::NodeHandle nh)
    : subscriber_(nh.subscribe("/mapping/mesh", 1000, &MeshWatcher::onMarkers, this)) {}

size_t MeshWatcher::triangles() const {
  size_t count = 0;
  for (const auto& [id, marker] : shown_) count += marker.points.size() / 3;
  return count;
}

void MeshWatcher::onMarkers(const visualization_msgs::MarkerArray::ConstPtr& message) {
  for (const Marker& marker : message->markers) {
    if (marker.action == Marker::DELETEALL) {
      shown_.clear();
    } else if (marker.action == Marker::DELETE) {
      shown_.erase(marker.id);
      ++deleted_;
    } else {
      shown_[marker.id] = marker;
      ++added_;
    }
  }
}

}  // namespace dtsdf
