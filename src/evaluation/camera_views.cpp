#include "dtsdf_mapping/evaluation/camera_views.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "dtsdf_mapping/simulation/scene.h"

namespace dtsdf {

namespace {

constexpr double kPi = 3.14159265358979323846;

/// Azimuth about y and elevation above the plane y = 0 of view number i, in radians.
struct ViewAngles {
  double azimuth, elevation;
};

ViewAngles viewAngles(Trajectory trajectory, size_t i, size_t count) {
  const double share = static_cast<double>(i) / static_cast<double>(count);
  const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
  switch (trajectory) {
    case Trajectory::kCircle: return {2.0 * kPi * share, 0.0};
    case Trajectory::kHelix: return {2.0 * kPi * 5.0 * share, (middle - 0.5) * 2.0 * kPi / 3.0};
    case Trajectory::kSphere: break;
  }
  // Equal steps in height cut the sphere into rings of equal area; the number of turns makes the
  // distance between turns about that between neighbours on a turn.
  const double turns = std::max(1.0, std::round(std::sqrt(static_cast<double>(count) / kPi)));
  return {2.0 * kPi * turns * middle, std::asin(2.0 * middle - 1.0)};
}

/// Rows of a TUM list, comments left out, by stamp.
std::map<double, std::string> readStampedLines(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + ": cannot be opened");
  std::map<double, std::string> lines;
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    double stamp_s = 0.0;
    if (!(words >> stamp_s)) throw std::runtime_error(path + ": bad line '" + line + "'");
    std::string rest;
    std::getline(words, rest);
    lines[stamp_s] = rest;
  }
  return lines;
}

Eigen::Isometry3d parsePose(const std::string& path, const std::string& text) {
  std::istringstream words(text);
  double t[3], q[4];  // x, y, z and x, y, z, w
  for (double& number : t) words >> number;
  for (double& number : q) words >> number;
  if (!words) throw std::runtime_error(path + ": bad pose '" + text + "'");
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear() = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  T_W_C.translation() = Eigen::Vector3d(t[0], t[1], t[2]);
  return T_W_C;
}

ViewCamera readCamera(const std::string& path) {
  try {
    const YAML::Node info = YAML::LoadFile(path);
    ViewCamera camera;
    camera.width = info["image_width"].as<int>();
    camera.height = info["image_height"].as<int>();
    const auto K = info["camera_matrix"]["data"].as<std::vector<float>>();
    if (K.size() != 9) throw std::runtime_error("camera_matrix needs 9 numbers");
    camera.intrinsics = {K[0], K[4], K[2], K[5]};
    return camera;
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

}  // namespace

Trajectory trajectoryFromName(const std::string& name) {
  if (name == "circle") return Trajectory::kCircle;
  if (name == "helix") return Trajectory::kHelix;
  if (name == "sphere") return Trajectory::kSphere;
  throw std::invalid_argument("unknown trajectory '" + name + "': circle, helix or sphere");
}

std::vector<Eigen::Isometry3d> orbitPoses(Trajectory trajectory, size_t count, double radius_m) {
  std::vector<Eigen::Isometry3d> poses_W_C;
  for (size_t i = 0; i < count; ++i) {
    const ViewAngles view = viewAngles(trajectory, i, count);
    const Eigen::Vector3d eye_W(radius_m * std::cos(view.elevation) * std::sin(view.azimuth),
                                radius_m * std::sin(view.elevation),
                                radius_m * std::cos(view.elevation) * std::cos(view.azimuth));
    poses_W_C.push_back(lookAt(eye_W, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY()));
  }
  return poses_W_C;
}

Views readViews(const std::string& tum_directory) {
  Views views;
  views.camera = readCamera(tum_directory + "/camera_info.yaml");
  const std::string pose_path = tum_directory + "/groundtruth.txt";
  const auto poses = readStampedLines(pose_path);
  for (const auto& [stamp_s, file] : readStampedLines(tum_directory + "/depth.txt")) {
    auto after = poses.lower_bound(stamp_s);
    if (after == poses.end() ||
        (after != poses.begin() &&
         stamp_s - std::prev(after)->first < after->first - stamp_s)) {
      if (after == poses.begin()) continue;
      --after;
    }
    constexpr double kLargestGap_s = 0.02;  // as the TUM tools associate
    if (std::abs(after->first - stamp_s) > kLargestGap_s) continue;
    views.poses_W_C.push_back(parsePose(pose_path, after->second));
  }
  if (views.poses_W_C.empty()) throw std::runtime_error(tum_directory + ": no view has a pose");
  return views;
}

}  // namespace dtsdf
