#include "ros/output/pose_status.h"

#include <geometry_msgs/Vector3.h>

#include <vector>

namespace dtsdf {
namespace {

std::vector<geometry_msgs::Vector3> toVectors(const std::vector<Eigen::Vector3d>& axes) {
  std::vector<geometry_msgs::Vector3> vectors;
  for (const Eigen::Vector3d& axis : axes) {
    geometry_msgs::Vector3 vector;
    vector.x = axis.x();
    vector.y = axis.y();
    vector.z = axis.z();
    vectors.push_back(vector);
  }
  return vectors;
}

}  // namespace

dtsdf_mapping::PoseStatus makePoseStatus(const CameraPoseReport& report) {
  dtsdf_mapping::PoseStatus status;
  if (!report.last) return status;
  status.outcome = toString(report.last->status);
  status.stamp = report.stamp;
  status.matched_share = static_cast<float>(report.last->matched_share);
  status.inlier_share = static_cast<float>(report.last->inlier_share);
  status.residual_m = static_cast<float>(report.last->residual_m);
  status.correction_m = static_cast<float>(report.last->shift_m);
  status.correction_rad = static_cast<float>(report.last->turn_rad);
  status.free_shifts = toVectors(report.free_shifts);
  status.free_turns = toVectors(report.free_turns);
  if (report.lost_since_s) status.lost_since = ros::Time(*report.lost_since_s);
  for (int i = 0; i < kAlignmentStatusCount; ++i) {
    if (report.outcomes[i] == 0) continue;
    dtsdf_mapping::DropCount count;
    count.reason = toString(static_cast<AlignmentStatus>(i));
    count.count = report.outcomes[i];
    status.outcomes.push_back(count);
  }
  return status;
}

}  // namespace dtsdf
