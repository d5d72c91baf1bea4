/// The small motion that takes points to planes.
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace dtsdf {

/// A point and the plane that it belongs on.
struct PointToPlane {
  Eigen::Vector3d p_W, normal_W;
  double distance_m;  ///< From the point to the plane, along the normal.
  double weight;
};

/// One step of Gauss and Newton for all points at once, with no part along which the planes hardly
/// hold them. @pre There are some.
Eigen::Isometry3d motionOf(const std::vector<PointToPlane>& pairs);

/// Tukey's biweight: 1 for a difference of nothing, 0 from `reach` on.
double biweight(double difference, double reach);

}  // namespace dtsdf
