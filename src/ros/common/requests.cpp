#include "ros/common/requests.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

#include "params/printable.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// The name of a frame is no longer than that.
constexpr size_t kLongestFrame = 200;
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
template <class Shape>
Shape checked(const Shape& shape) {
  const std::string problem = findProblem(shape);
  if (!problem.empty()) throw std::runtime_error(problem);
  return shape;
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
  return checked(box);
}

Region readRegion(const dtsdf_mapping::Box& box_message, const dtsdf_mapping::Sphere& message) {
  const std::optional<BoxRegion> box = readBox(box_message);
  const bool has_sphere = message.radius != 0.0;
  if (box && !has_sphere) return *box;
  if (box) throw std::runtime_error("both a box and a sphere are given; give one of them");
  if (!has_sphere) {
    throw std::runtime_error(
        "neither a box nor a sphere is given; give box.size, or sphere.radius, in metres");
  }
  return checked(
      SphereRegion{{message.center.x, message.center.y, message.center.z}, message.radius});
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

void fillAnswer(const KnownSpace& space, const std::vector<geometry_msgs::Point>& points,
                const Eigen::Isometry3d& T_W_F, dtsdf_mapping::GetDistances::Response& response) {
  const Eigen::Matrix3d R_F_W = T_W_F.linear().transpose();
  for (const geometry_msgs::Point& p : points) {
    const SpaceDistance distance = space.distanceAt(T_W_F * Eigen::Vector3d(p.x, p.y, p.z));
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

namespace {

namespace fs = std::filesystem;

bool liesIn(const fs::path& path, const fs::path& directory) {
  const auto [end, rest] =
      std::mismatch(directory.begin(), directory.end(), path.begin(), path.end());
  return end == directory.end() && rest != path.end();
}

/// The path with its links resolved, as far as it exists.
fs::path resolved(const fs::path& path, const std::string& advice) {
  std::error_code error;
  fs::path canonical = fs::weakly_canonical(fs::absolute(path), error);
  // Of a name that is too long only the whole path says so.
  if (!error) static_cast<void>(fs::status(canonical, error));
  if (!error || error == std::errc::no_such_file_or_directory ||
      error == std::errc::not_a_directory || error == std::errc::permission_denied) {
    return canonical;
  }
  throw std::runtime_error("'" + printable(path.string()) + "' cannot be used: " + error.message() +
                           "; " + advice);
}

}  // namespace

std::string expandHome(const std::string& path, const std::string& name) {
  if (path != "~" && path.rfind("~/", 0) != 0) return path;
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') {
    throw std::runtime_error(name + " is '" + path +
                             "', but HOME is not set; give an absolute path");
  }
  return (fs::path(home) / path.substr(std::min<size_t>(2, path.size()))).string();
}

std::string resolveOutputPath(const std::string& output_directory, const std::string& file_name,
                              const std::vector<std::string>& extensions, bool is_read) {
  if (file_name.empty()) {
    throw std::runtime_error("file_name is empty; give a name such as 'name" + extensions.front() +
                             "'");
  }
  if (hasControlCharacter(file_name)) {
    throw std::runtime_error("'" + printable(file_name) + "' contains a control character; " +
                             "give a plain name such as 'name" + extensions.front() + "'");
  }
  fs::path directory = resolved(expandHome(output_directory, "output_directory"),
                                "set output_directory to another folder");
  if (!directory.has_filename()) directory = directory.parent_path();  // "a/" -> "a"
  // An absolute file_name replaces the directory here, and has to lie in it like any other.
  const fs::path path = resolved(directory / file_name, "give another name");
  if (!is_read && !liesIn(path, directory)) {
    throw std::runtime_error("'" + printable(file_name) + "' is outside output_directory (" +
                             printable(directory.string()) + "); give a name under it");
  }
  const std::string extension = inLowerCase(path.extension().string());
  if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
    throw std::runtime_error("'" + printable(file_name) + "' has the wrong extension; use " +
                             joined(extensions, ", ", " or "));
  }
  return path.string();
}

GivenPoses readPath(const nav_msgs::Path& path, const std::string& child_frame) {
  if (path.header.frame_id.size() > kLongestFrame) {
    throw std::runtime_error("the name of its frame is too long");
  }
  GivenPoses given{{}, path.header.frame_id, child_frame};
  given.poses.reserve(path.poses.size());
  for (const geometry_msgs::PoseStamped& pose : path.poses) {
    given.poses.push_back({pose.header.stamp.toSec(), readPose(pose.pose)});
  }
  return given;
}

}  // namespace dtsdf
