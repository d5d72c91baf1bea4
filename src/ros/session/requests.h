/// Poses, regions and points as calls of services and paths give them.
#pragma once

#include <dtsdf_mapping/Box.h>
#include <dtsdf_mapping/GetDistances.h>
#include <dtsdf_mapping/Sphere.h>
#include <geometry_msgs/Pose.h>

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "dtsdf_mapping/region.h"
#include "dtsdf_mapping/space.h"

namespace dtsdf {

/// An orientation of all zeros is none. @throws std::runtime_error if it is not a rotation either,
/// or the position is not finite.
Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose);

/// Nothing if the size is all zeros. @throws std::runtime_error for a box with a problem, with what
/// it is.
std::optional<BoxRegion> readBox(const dtsdf_mapping::Box& box);

/// The one of both that is given.
/// @throws std::runtime_error if none is, or both are, or it has a problem; the text says what to
/// do.
Region readRegion(const dtsdf_mapping::Box& box, const dtsdf_mapping::Sphere& sphere);

/// A region of frame F in the map frame.
Region inMap(const Region& region, const Eigen::Isometry3d& T_W_F);

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
