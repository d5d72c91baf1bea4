#include "ros/common/requests.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "params/printable.h"
#include "params/text.h"

namespace dtsdf {
namespace {

Eigen::Quaterniond readOrientation(const geometry_msgs::Quaternion& q) {
  const Eigen::Quaterniond orientation(q.w, q.x, q.y, q.z);
  const double length = orientation.norm();
  if (length == 0.0) return Eigen::Quaterniond::Identity();
  constexpr double kTolerance = 1e-2;  // people type quaternions with few digits
  if (!(std::abs(length - 1.0) < kTolerance)) {
    throw std::runtime_error(
        "the orientation is not a quaternion of length 1; leave it out for a "
        "pose aligned with the frame's axes");
  }
  return orientation.normalized();
}

template <class Shape>
Shape checked(const Shape& region) {
  const std::string problem = findProblem(region);
  if (!problem.empty()) throw std::runtime_error(problem);
  return region;
}

}  // namespace

Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose) {
  const Eigen::Vector3d t(pose.position.x, pose.position.y, pose.position.z);
  if (!t.allFinite()) throw std::runtime_error("the position is not finite");
  return Eigen::Translation3d(t) * readOrientation(pose.orientation);
}

std::optional<BoxRegion> readBox(const dtsdf_mapping::Box& message,
                                 const Eigen::Isometry3d& T_W_F) {
  const Eigen::Vector3d size_m(message.size.x, message.size.y, message.size.z);
  if (size_m == Eigen::Vector3d::Zero()) return std::nullopt;
  return checked(BoxRegion{T_W_F * readPose(message.pose), size_m});
}

Region readRegion(const dtsdf_mapping::Box& box_message, const dtsdf_mapping::Sphere& sphere,
                  const Eigen::Isometry3d& T_W_F) {
  const std::optional<BoxRegion> box = readBox(box_message, T_W_F);
  const bool has_sphere = sphere.radius != 0.0;
  if (box && !has_sphere) return *box;
  if (box) throw std::runtime_error("both a box and a sphere are given; give only one of them");
  if (!has_sphere) {
    throw std::runtime_error(
        "neither a box nor a sphere is given; give box.size, or sphere.radius, in metres");
  }
  const Eigen::Vector3d center_F(sphere.center.x, sphere.center.y, sphere.center.z);
  return checked(SphereRegion{T_W_F * center_F, sphere.radius});
}

namespace fs = std::filesystem;

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
  const fs::path given = fs::absolute(expandHome(output_directory, "output_directory"));
  const fs::path directory = fs::weakly_canonical(given);  // resolves links
  // An absolute file_name replaces the directory here, and is checked like any other.
  const fs::path path = fs::weakly_canonical(directory / expandHome(file_name, "file_name"));
  if (!is_read && *path.lexically_relative(directory).begin() == "..") {
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

}  // namespace dtsdf
