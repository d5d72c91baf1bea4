#include "map/region_view.h"

#include <cmath>

namespace dtsdf {
namespace {

Vec3d scaled(const Eigen::Vector3d& v, double factor) {
  return {v.x() * factor, v.y() * factor, v.z() * factor};
}

std::string findBoxProblem(const BoxRegion& box) {
  if (!box.T_W_B.matrix().allFinite() || !box.size_m.allFinite()) {
    return "the box's pose or size is not finite";
  }
  if (!(box.size_m.minCoeff() > 0.0)) return "the box's size must be above 0 along each axis";
  const Eigen::Matrix3d R = box.T_W_B.linear();
  constexpr double kRotationTolerance = 1e-3;
  if (!(R * R.transpose()).isIdentity(kRotationTolerance) || R.determinant() < 0.0) {
    return "the box's pose is not a rigid transform";
  }
  return "";
}

std::string findSphereProblem(const SphereRegion& sphere) {
  if (!sphere.center_W.allFinite() || !std::isfinite(sphere.radius_m)) {
    return "the sphere's centre or radius is not finite";
  }
  return sphere.radius_m > 0.0 ? "" : "the sphere's radius must be above 0";
}

}  // namespace

std::string findProblem(const Region& region) {
  const BoxRegion* const box = std::get_if<BoxRegion>(&region);
  return box != nullptr ? findBoxProblem(*box) : findSphereProblem(std::get<SphereRegion>(region));
}

RegionView makeRegionView(const Region& region, double unit_m) {
  const double units = 1.0 / unit_m;
  RegionView view = {};
  if (const SphereRegion* const sphere = std::get_if<SphereRegion>(&region)) {
    view.is_sphere = 1;
    view.center = scaled(sphere->center_W, units);
    view.radius = sphere->radius_m * units;
    return view;
  }
  const BoxRegion& box = std::get<BoxRegion>(region);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      view.R_B_W[3 * row + column] = box.T_W_B.linear()(column, row);
    }
  }
  view.center = scaled(box.T_W_B.translation(), units);
  view.half = scaled(box.size_m, 0.5 * units);
  return view;
}

}  // namespace dtsdf
