#include "ros/session/distance_request.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace dtsdf {

void checkPoints(const std::vector<geometry_msgs::Point>& points) {
  if (points.size() > kMostQueryPoints) {
    throw std::runtime_error(std::to_string(points.size()) + " points are more than the " +
                             std::to_string(kMostQueryPoints) +
                             " allowed per call; split the call");
  }
  for (size_t i = 0; i < points.size(); ++i) {
    const geometry_msgs::Point& p = points[i];
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
    throw std::runtime_error("point " + std::to_string(i) +
                             " is not finite; leave such points out");
  }
}

std::vector<Eigen::Vector3d> inMap(const std::vector<geometry_msgs::Point>& points,
                                   const Eigen::Isometry3d& T_W_F) {
  std::vector<Eigen::Vector3d> points_W;
  points_W.reserve(points.size());
  for (const geometry_msgs::Point& p : points) {
    points_W.push_back(T_W_F * Eigen::Vector3d(p.x, p.y, p.z));
  }
  return points_W;
}

void fillAnswer(const KnownSpace& space, const std::vector<Eigen::Vector3d>& points_W,
                const Eigen::Isometry3d& T_W_F, dtsdf_mapping::GetDistances::Response& response) {
  const Eigen::Matrix3d R_F_W = T_W_F.linear().transpose();
  response.known.reserve(points_W.size());
  response.distances.reserve(points_W.size());
  response.gradients.reserve(points_W.size());
  for (const Eigen::Vector3d& p_W : points_W) {
    const SpaceDistance distance = space.distanceAt(p_W);
    const Vec3f& g = distance.gradient;
    const Eigen::Vector3d g_F = R_F_W * Eigen::Vector3d(g.x, g.y, g.z);
    geometry_msgs::Vector3 gradient;
    gradient.x = g_F.x();
    gradient.y = g_F.y();
    gradient.z = g_F.z();
    response.known.push_back(distance.known ? 1 : 0);
    response.distances.push_back(distance.distance_m);
    response.gradients.push_back(gradient);
  }
}

}  // namespace dtsdf
