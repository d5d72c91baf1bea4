#include "ros/session/requests.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace dtsdf {
namespace {

/// Points that one call may have.
constexpr size_t kMostQueryPoints = 100000;

Eigen::Quaterniond readOrientation(const geometry_msgs::Quaternion& q) {
  const Eigen::Quaterniond orientation(q.w, q.x, q.y, q.z);
  const double length = orientation.norm();
  if (length == 0.0) return Eigen::Quaterniond::Identity();
  constexpr double kTolerance = 1e-2;  // people type quaternions with few digits
  if (!(std::abs(length - 1.0) < kTolerance)) {
    throw std::runtime_error(
        "the orientation is not a quaternion of length 1; leave it out for a "
        "pose along the frame's axes");
  }
  return orientation.normalized();
}

/// @throws std::runtime_error if it has a problem.
void check(const Region& region) {
  const std::string problem = findProblem(region);
  if (!problem.empty()) throw std::runtime_error(problem);
}

}  // namespace

Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose) {
  const Eigen::Vector3d t(pose.position.x, pose.position.y, pose.position.z);
  if (!t.allFinite()) throw std::runtime_error("the position is not finite");
  return Eigen::Translation3d(t) * readOrientation(pose.orientation);
}

std::optional<BoxRegion> readBox(const dtsdf_mapping::Box& message) {
  BoxRegion box;
  box.size_m = {message.size.x, message.size.y, message.size.z};
  if (box.size_m == Eigen::Vector3d::Zero()) return std::nullopt;
  box.T_W_B = readPose(message.pose);
  check(box);
  return box;
}

Region readRegion(const dtsdf_mapping::Box& box_message, const dtsdf_mapping::Sphere& message) {
  const std::optional<BoxRegion> box = readBox(box_message);
  if (box && message.radius != 0.0) {
    throw std::runtime_error("both a box and a sphere are given; give one of them");
  }
  if (box) return *box;
  if (message.radius == 0.0) {
    throw std::runtime_error(
        "neither a box nor a sphere is given; give box.size, or "
        "sphere.radius, in metres");
  }
  const SphereRegion sphere{{message.center.x, message.center.y, message.center.z}, message.radius};
  check(sphere);
  return sphere;
}

Region inMap(const Region& region, const Eigen::Isometry3d& T_W_F) {
  if (const auto* const sphere = std::get_if<SphereRegion>(&region)) {
    return SphereRegion{T_W_F * sphere->center_W, sphere->radius_m};
  }
  const auto& box = std::get<BoxRegion>(region);
  return BoxRegion{T_W_F * box.T_W_B, box.size_m};
}

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
