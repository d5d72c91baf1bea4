/// Reads the grid and its updates like StaticLayer in costmap_2d: it subscribes to updates after
/// the first grid and applies them relative to the grid's corner. Unlike StaticLayer, it checks
/// bounds.
#pragma once

#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/node_handle.h>

#include <cstddef>
#include <cstdint>

namespace dtsdf {

class GridReader {
 public:
  explicit GridReader(ros::NodeHandle nh);

  /// The last grid, with all updates applied.
  const nav_msgs::OccupancyGrid& grid() const { return grid_; }

  size_t grids() const { return grids_; }
  size_t updates() const { return updates_; }
  /// Number of updates skipped because they extended beyond the grid.
  size_t misplaced() const { return misplaced_; }

  /// Number of cells with this value.
  size_t count(int8_t value) const;

  /// The value at a point in the map frame, or -2 outside the grid.
  int at(double x_m, double y_m) const;

 private:
  void onGrid(const nav_msgs::OccupancyGrid::ConstPtr& grid);
  void onUpdate(const map_msgs::OccupancyGridUpdate::ConstPtr& update);

  ros::NodeHandle nh_;
  nav_msgs::OccupancyGrid grid_;
  size_t grids_ = 0, updates_ = 0, misplaced_ = 0;
  ros::Subscriber grid_subscriber_, update_subscriber_;
};

}  // namespace dtsdf
