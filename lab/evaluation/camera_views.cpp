#include "evaluation/camera_views.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "io/depth_codes.h"
#include "io/formats/folder_format.h"
#include "io/tum_lists.h"
#include "simulation/scene.h"

namespace dtsdf {

namespace {

/// Azimuth about y and elevation above the plane y = 0, in radians.
struct ViewAngles {
  double azimuth, elevation;
};

ViewAngles viewAngles(OrbitShape shape, size_t i, size_t count) {
  const double share = static_cast<double>(i) / static_cast<double>(count);
  const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
  switch (shape) {
    case OrbitShape::kCircle:
    case OrbitShape::kHand: return {2.0 * M_PI * share, 0.0};
    case OrbitShape::kHelix: return {2.0 * M_PI * 5.0 * share, (middle - 0.5) * 2.0 * M_PI / 3.0};
    case OrbitShape::kSphere: break;
  }
  // Equal steps in height divide the sphere into rings of equal area. With this number of turns,
  // the distance between adjacent turns is about that between adjacent views.
  const double turns = std::max(1.0, std::round(std::sqrt(static_cast<double>(count) / M_PI)));
  return {2.0 * M_PI * turns * middle, std::asin(2.0 * middle - 1.0)};
}

}  // namespace

ViewCamera centredCamera(int width, int height, double focal_px) {
  const auto focal = static_cast<float>(focal_px);
  return {
      {focal, focal, 0.5f * static_cast<float>(width - 1), 0.5f * static_cast<float>(height - 1)},
      width,
      height};
}

Eigen::Vector3f rayOf(const Intrinsics& K, float u_px, float v_px) {
  return {(u_px - K.cx) / K.fx, (v_px - K.cy) / K.fy, 1.0f};
}

OrbitShape orbitShapeFromName(const std::string& name) {
  if (name == "circle") return OrbitShape::kCircle;
  if (name == "helix") return OrbitShape::kHelix;
  if (name == "sphere") return OrbitShape::kSphere;
  if (name == "hand") return OrbitShape::kHand;
  throw std::invalid_argument("unknown trajectory '" + name +
                              "'; use circle, helix, sphere or hand");
}

std::vector<Eigen::Isometry3d> orbitPoses(OrbitShape shape, size_t count, double radius_m) {
  std::vector<Eigen::Isometry3d> poses_W_C;
  for (size_t i = 0; i < count; ++i) {
    const ViewAngles view = viewAngles(shape, i, count);
    const Eigen::Vector3d eye_W(radius_m * std::cos(view.elevation) * std::sin(view.azimuth),
                                radius_m * std::sin(view.elevation),
                                radius_m * std::cos(view.elevation) * std::cos(view.azimuth));
    poses_W_C.push_back(lookAt(eye_W, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY()));
  }
  return poses_W_C;
}

Views readViews(const std::string& tum_folder) {
  constexpr double kPoseTolerance_s = 0.02;  // the default of reconstruct
  const CameraInfo camera = readTumCamera(tum_folder).value_or(*tumFormat().usual_camera);
  const Trajectory trajectory = readTumTrajectory(tum_folder);
  Views views;
  views.camera = {camera.intrinsics, camera.width, camera.height};
  for (const StampedImage& image : readTumDepthList(tum_folder)) {
    const auto T_W_C = trajectory.poseAt(image.stamp_s, kPoseTolerance_s);
    if (!T_W_C) continue;
    views.poses_W_C.push_back(*T_W_C);
    views.depth_paths.push_back(image.path);
  }
  if (views.poses_W_C.empty()) throw std::runtime_error(tum_folder + ": no image has a pose");
  return views;
}

std::vector<float> readTumDepth(const std::string& path, const ViewCamera& camera) {
  constexpr float kTumUnit_m = 1.0f / 5000.0f;
  std::vector<float> depth_m;
  for (const uint16_t units : readDepthPng(path, camera.width, camera.height)) {
    depth_m.push_back(kTumUnit_m * static_cast<float>(units));
  }
  return depth_m;
}

}  // namespace dtsdf
