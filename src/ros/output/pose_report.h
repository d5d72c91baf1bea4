/// What the status reports of poses that are aligned to the map.
#pragma once

#include <ros/time.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/alignment.h"

namespace dtsdf {

constexpr int kAlignmentStatusCount = static_cast<int>(AlignmentStatus::kUnsure) + 1;

/// How the depth images of one camera fit the map.
struct CameraPoseReport {
  std::optional<Alignment> last;                         ///< Of the newest image.
  ros::Time stamp;                                       ///< Of that one.
  std::vector<Eigen::Vector3d> free_shifts, free_turns;  ///< See freeAxes().
  std::optional<double> lost_since_s;  ///< First image that did not fit; none: followed.
  std::array<uint64_t, kAlignmentStatusCount> outcomes{};  ///< Images, by AlignmentStatus.
};

struct PoseReport {
  std::vector<CameraPoseReport> cameras;  ///< In their order; empty where poses/mode is tf.
  std::string problem;                    ///< Why poses are not on /tf; empty: they are.
  size_t trajectory_bytes = 0, max_trajectory_bytes = 0;
};

}  // namespace dtsdf
