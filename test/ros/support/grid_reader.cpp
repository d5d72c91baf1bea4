#include "ros/support/grid_reader.h"

#include <algorithm>
#include <cmath>

namespace dtsdf {

GridReader::GridReader(ros::NodeHandle nh)
    : nh_(nh),
      grid_subscriber_(nh.subscribe("/mapping/occupancy_grid", 1, &GridReader::onGrid, this)) {}

void GridReader::onGrid(const nav_msgs::OccupancyGrid::ConstPtr& grid) {
  grid_ = *grid;
  ++grids_;
  if (update_subscriber_) return;
  update_subscriber_ =
      nh_.subscribe("/mapping/occupancy_grid_updates", 10, &GridReader::onUpdate, this);
}

void GridReader::onUpdate(const map_msgs::OccupancyGridUpdate::ConstPtr& update) {
  ++updates_;
  const auto width = static_cast<int64_t>(grid_.info.width),
             height = static_cast<int64_t>(grid_.info.height);
  if (update->x < 0 || update->y < 0 || update->x + update->width > width ||
      update->y + update->height > height) {
    ++misplaced_;
    return;
  }
  auto next = update->data.begin();
  for (uint32_t y = 0; y < update->height; ++y) {
    for (uint32_t x = 0; x < update->width; ++x) {
      const size_t row = static_cast<size_t>(update->y) + y;
      grid_.data[row * grid_.info.width + static_cast<size_t>(update->x) + x] = *next++;
    }
  }
}

size_t GridReader::count(int8_t value) const {
  return static_cast<size_t>(std::count(grid_.data.begin(), grid_.data.end(), value));
}

int GridReader::at(double x_m, double y_m) const {
  const double step = grid_.info.resolution;
  const auto x = static_cast<int64_t>(std::floor((x_m - grid_.info.origin.position.x) / step)),
             y = static_cast<int64_t>(std::floor((y_m - grid_.info.origin.position.y) / step));
  if (x < 0 || y < 0 || x >= grid_.info.width || y >= grid_.info.height) return -2;
  return grid_.data[static_cast<size_t>(y) * grid_.info.width + static_cast<size_t>(x)];
}

}  // namespace dtsdf
