/// Requests for distances, as service calls give them, and their answers.
#pragma once

#include <dtsdf_mapping/GetDistances.h>

#include <Eigen/Geometry>
#include <vector>

#include "dtsdf_mapping/space.h"

namespace dtsdf {

/// Points that one call may have.
constexpr size_t kMostQueryPoints = 100000;

/// Before any frame is looked up.
/// @throws std::runtime_error for too many points, or one that is not finite.
void checkPoints(const std::vector<geometry_msgs::Point>& points);

/// Points of frame F in the map frame.
std::vector<Eigen::Vector3d> inMap(const std::vector<geometry_msgs::Point>& points,
                                   const Eigen::Isometry3d& T_W_F);

/// Gradients are turned into frame F.
void fillAnswer(const KnownSpace& space, const std::vector<Eigen::Vector3d>& points_W,
                const Eigen::Isometry3d& T_W_F, dtsdf_mapping::GetDistances::Response& response);

}  // namespace dtsdf
