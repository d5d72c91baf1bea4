/// Parts of space, in the map frame: what is cleared, or saved alone.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <variant>

namespace dtsdf {

/// A box of any orientation, its faces included.
struct BoxRegion {
  /// Box to map frame, in metres; B's origin is the box's centre, its axes lie along the edges.
  Eigen::Isometry3d T_W_B = Eigen::Isometry3d::Identity();
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  ///< Whole extents along B's axes, in metres.
};

/// A ball with its surface.
struct SphereRegion {
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();  ///< In metres.
  double radius_m = 0.0;                               ///< In metres.
};

/// Either of them.
using Region = std::variant<BoxRegion, SphereRegion>;

/// Describes what is wrong with a region: a number that is not finite, a size that is not above 0,
/// a pose that is not a rotation and translation. Empty if nothing is.
std::string findProblem(const Region& region);

}  // namespace dtsdf
