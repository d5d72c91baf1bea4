/// What leaves of space: the grid of the ground and its updates, and slices of distances.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "ros/output/grid_publisher.h"
#include "ros/output/slice_publisher.h"
#include "ros/output/space_handover.h"

namespace dtsdf {

/// Output's thread only, but for report(). While nobody listens, it wants nothing of the map.
class SpaceOutput {
 public:
  struct Options {
    std::string map_frame;
    GroundHeights heights;
    double slice_height_m;
  };

  SpaceOutput(ros::NodeHandle nh, const Options& options, SpaceHandover& handover);

  /// Publishes what is due. Returns how long there will be nothing to do.
  std::chrono::milliseconds step() noexcept;

  std::vector<TopicReport> report() const;

 private:
  void work();

  SpaceHandover& handover_;
  GridPublisher grid_;
  SlicePublisher slice_;

  mutable std::mutex report_mutex_;
  std::vector<TopicReport> report_;
};

}  // namespace dtsdf
