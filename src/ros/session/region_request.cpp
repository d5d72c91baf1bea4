#include "ros/session/region_request.h"

#include <stdexcept>

#include "ros/session/pose_request.h"

namespace dtsdf {
namespace {

/// @throws std::runtime_error if it has a problem.
void check(const Region& region) {
  const std::string problem = findProblem(region);
  if (!problem.empty()) throw std::runtime_error(problem);
}

}  // namespace

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
    throw std::runtime_error("neither a box nor a sphere is given; give box.size, or "
                             "sphere.radius, in metres");
  }
  const SphereRegion sphere{{message.center.x, message.center.y, message.center.z},
                            message.radius};
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

}  // namespace dtsdf
