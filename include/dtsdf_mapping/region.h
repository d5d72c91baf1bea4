/// Regions in the map frame, for clearing or saving parts of a map.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <variant>

namespace dtsdf {

/// A box in any orientation, including its faces.
struct BoxRegion {
  /// Box frame B to map frame, in metres. The origin of B is the centre of the box, and its axes
  /// are parallel to the edges.
  Eigen::Isometry3d T_W_B = Eigen::Isometry3d::Identity();
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  ///< Edge lengths along B's axes, in metres.
};

/// A ball including its surface.
struct SphereRegion {
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();  ///< In metres.
  double radius_m = 0.0;                               ///< In metres.
};

/// A box or a ball.
using Region = std::variant<BoxRegion, SphereRegion>;

/// Describes what is wrong with a region: a number that is not finite, a size that is not positive,
/// or a pose that is not a rotation and translation. Empty if the region is valid.
std::string findProblem(const Region& region);

}  // namespace dtsdf
