/// Distances at points, between the middles of cells.
#pragma once

#include <Eigen/Core>

#include "dtsdf_mapping/space.h"
#include "space/distance_field.h"

namespace dtsdf {

/// As KnownSpace::distanceAt() says, by the squared distances of the cells around a point.
/// @param reach Of distances, in cells.
SpaceDistance interpolatedDistance(const KnownSpace& space, const DistanceSectors& sectors,
                                   int reach, const Eigen::Vector3d& p_W);

}  // namespace dtsdf
