/// What leaves of space: the grid of the ground and its updates, and slices of distances.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "ros/output/grid_publisher.h"
#include "ros/output/map_report.h"
#include "ros/output/slice_publisher.h"
#include "ros/output/space_handover.h"

namespace dtsdf {

/// Output's thread only, but for addTo(). While nobody listens, it wants nothing of the map.
class SpaceOutput {
 public:
  struct Options {
    std::string map_frame;
    GroundHeights heights;
    double slice_height_m;
  };

  SpaceOutput(const ros::NodeHandle& nh, const Options& options, SpaceHandover& handover);

  /// Publishes what is due. Returns how long there will be nothing to do.
  std::chrono::milliseconds step() noexcept;

  /// Adds its topics and memory.
  void addTo(OutputReport& report) const;

 private:
  void work();

  SpaceHandover& handover_;
  GridPublisher grid_;
  SlicePublisher slice_;

  mutable std::mutex report_mutex_;
  std::vector<TopicReport> topics_;
  size_t grid_bytes_ = 0;
};

}  // namespace dtsdf
