#include "ros/output/mesh_publisher.h"

#include <ros/single_subscriber_publisher.h>

#include <boost/make_shared.hpp>

#include <utility>

#include "ros/common/callback_guard.h"
#include "ros/output/mesh_markers.h"

namespace dtsdf {
namespace {

/// Messages that may wait for a slow subscriber. A lost one would be a hole in its mesh.
constexpr int kPublisherQueue = 200;
/// A message for a newcomer is cut here: 500 000 triangles are 60 MB.
constexpr size_t kMaxPointsPerMessage = 1500000;

}  // namespace

MeshPublisher::MeshPublisher(ros::NodeHandle nh, const Style& style, OnNewcomer on_newcomer)
    : style_(style), chunks_(style.chunk_blocks) {
  publisher_ = nh.advertise<visualization_msgs::MarkerArray>(
      "mesh", kPublisherQueue,
      [on_newcomer = std::move(on_newcomer)](const ros::SingleSubscriberPublisher& newcomer) {
        guarded("new subscriber of mesh", [&] { on_newcomer(newcomer); });
      });
}

visualization_msgs::Marker MeshPublisher::makeMarker(const MeshStore& mesh,
                                                     PackedKey chunk) const {
  return makeMeshMarker(mesh.assemble(chunks_.blocksOf(chunk)), style_.colour, style_.map_frame,
                        chunks_.idOf(chunk));
}

void MeshPublisher::publishChanges(const MeshStore& mesh) {
  auto message = boost::make_shared<visualization_msgs::MarkerArray>();
  for (const PackedKey chunk : chunks_.changed()) {
    visualization_msgs::Marker marker = makeMarker(mesh, chunk);
    const bool visible = marker.action == visualization_msgs::Marker::ADD;
    const bool was_shown = visible ? !shown_.insert(chunk).second : shown_.erase(chunk) > 0;
    if (visible || was_shown) message->markers.push_back(std::move(marker));
  }
  chunks_.forgetChanges();
  if (!message->markers.empty()) publisher_.publish(message);
}

void MeshPublisher::publishAll(const MeshStore& mesh,
                               const ros::SingleSubscriberPublisher& newcomer) {
  visualization_msgs::MarkerArray message;
  message.markers.push_back(makeDeleteAllMarker(style_.map_frame));
  size_t points = 0;
  for (const PackedKey chunk : chunks_.all()) {
    visualization_msgs::Marker marker = makeMarker(mesh, chunk);
    if (marker.action != visualization_msgs::Marker::ADD) continue;
    shown_.insert(chunk);
    points += marker.points.size();
    message.markers.push_back(std::move(marker));
    if (points > kMaxPointsPerMessage) {
      newcomer.publish(message);
      message.markers.clear();
      points = 0;
    }
  }
  if (!message.markers.empty()) newcomer.publish(message);
  if (listeners() <= 1) chunks_.forgetChanges();  // nobody else waits for them
}

}  // namespace dtsdf
