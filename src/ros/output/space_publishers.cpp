#include "ros/output/space_publishers.h"

#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/console.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <optional>

namespace dtsdf {
namespace {

constexpr bool kLatched = true;

void warnOfSize(const GridBox& window) {
  ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                 "occupancy_grid would have "
                                     << window.width << " x " << window.height
                                     << " cells, more than " << GroundGrid::kMostColumns
                                     << ", so it keeps its present part; use larger cells "
                                        "(space/cell_voxels) or map/keep_radius_m, and look for "
                                        "frames with wrong poses");
}

}  // namespace

GridPublisher::GridPublisher(const ros::NodeHandle& nh, const std::string& map_frame,
                             const GroundHeights& heights)
    : map_frame_(map_frame),
      heights_(heights),
      grid_(heights),
      grids_(nh, topicOf<nav_msgs::OccupancyGrid>("occupancy_grid", kLatched)),
      updates_(nh, topicOf<map_msgs::OccupancyGridUpdate>("occupancy_grid_updates", kLatched)) {}

void GridPublisher::apply(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp) {
  grid_.apply(changes, cell_size_m);
  stamp_ = stamp;
}

void GridPublisher::forget() {
  if (grid_.bytes() == 0) return;
  grid_ = GroundGrid(heights_);
  grids_.outdate();
}

void GridPublisher::serve(SteadyTime now) {
  follow(updates_.links(), followers_, [&](StaticLayerPace& pace) { pace.startOver(now); });
  serveGrids(now);
  serveUpdates(now);
}

void GridPublisher::renew(SteadyTime now) {
  const PendingGrid pending = grid_.next();
  if (pending.too_large) warnOfSize(*pending.too_large);
  switch (pending.kind) {
    case PendingGrid::Kind::kGrid:
      grids_.outdate();
      for (auto& [link, pace] : followers_) pace.startOver(now);
      return;
    case PendingGrid::Kind::kUpdate:
      for (auto& [link, pace] : followers_) pace.noteChange();
      return;
    case PendingGrid::Kind::kNothing: return;
  }
}

/// Whether a node has yet to read what was sent to it.
bool GridPublisher::isBusy(const ListenerTopic::Links& links, const std::string& name) const {
  return std::any_of(links.begin(), links.end(), [&](const Link& link) {
    return link->name() == name && link->waitingBytes() > 0;
  });
}

void GridPublisher::serveGrids(SteadyTime now) {
  const ListenerTopic::Links& grid_links = grids_.links();
  if (!grid_.window()) return;
  std::optional<ros::SerializedMessage> message;
  const ListenerTopic::Links& update_links = updates_.links();
  for (const Link& link : grid_links) {
    if (!link->lacksNewest() || isBusy(update_links, link->name())) continue;
    if (!message) message = gridMessage();
    grids_.send(*link, *message);
    for (auto& [follower_link, pace] : followers_) {
      if (follower_link->name() == link->name()) pace.startOver(now);
    }
  }
}

void GridPublisher::serveUpdates(SteadyTime now) {
  if (!grid_.window()) return;
  std::optional<ros::SerializedMessage> whole, changed;
  const ListenerTopic::Links& grid_links = grids_.links();
  for (auto& [link, pace] : followers_) {
    if (!pace.isDue(now) || link->waitingBytes() > 0) continue;
    if (isBusy(grid_links, link->name())) continue;
    const bool is_whole = pace.takeUpdate(now);
    const GridBox& box = is_whole ? *grid_.window() : grid_.changed();
    if (box.isEmpty()) continue;
    std::optional<ros::SerializedMessage>& message = is_whole ? whole : changed;
    if (!message) message = updateMessage(box);
    updates_.send(*link, *message);
  }
}

ros::SerializedMessage GridPublisher::gridMessage() const {
  const GridBox& window = *grid_.window();
  nav_msgs::OccupancyGrid grid;
  grid.header.frame_id = map_frame_;
  grid.header.stamp = grid.info.map_load_time = stamp_;
  grid.info.resolution = static_cast<float>(grid_.cellSize_m());
  grid.info.width = static_cast<uint32_t>(window.width);
  grid.info.height = static_cast<uint32_t>(window.height);
  grid.info.origin.position.x = window.x * grid_.cellSize_m();
  grid.info.origin.position.y = window.y * grid_.cellSize_m();
  grid.info.origin.orientation.w = 1.0;
  grid.data = grid_.values(window);
  return ros::serialization::serializeMessage(grid);
}

ros::SerializedMessage GridPublisher::updateMessage(const GridBox& box) const {
  map_msgs::OccupancyGridUpdate update;
  update.header.frame_id = map_frame_;
  update.header.stamp = stamp_;
  update.x = box.x - grid_.window()->x;
  update.y = box.y - grid_.window()->y;
  update.width = static_cast<uint32_t>(box.width);
  update.height = static_cast<uint32_t>(box.height);
  update.data = grid_.values(box);
  return ros::serialization::serializeMessage(update);
}

SlicePublisher::SlicePublisher(const ros::NodeHandle& nh, const std::string& map_frame,
                               double height_m)
    : map_frame_(map_frame),
      height_m_(height_m),
      topic_(nh, topicOf<sensor_msgs::PointCloud2>("distance_slice")) {}

void SlicePublisher::put(const SpaceSlice& slice) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = map_frame_;
  cloud.header.stamp = slice.stamp;
  cloud.height = 1;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(4, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "intensity", 1,
                                kFloat);
  modifier.resize(slice.cells.size());
  sensor_msgs::PointCloud2Iterator<float> next(cloud, "x");
  for (const SliceCell& cell : slice.cells) {
    const Eigen::Vector3f p = pointInSlice(cell, slice.cell_size_m, height_m_).cast<float>();
    next[0] = p.x();
    next[1] = p.y();
    next[2] = p.z();
    next[3] = cell.distance_m;
    ++next;
  }
  newest_ = ros::serialization::serializeMessage(cloud);
  topic_.outdate();
}

void SlicePublisher::serve() { topic_.sendNewest(newest_); }

}  // namespace dtsdf
