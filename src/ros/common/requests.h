/// What calls of services give: poses, regions, and names of files.
#pragma once

#include <dtsdf_mapping/Box.h>
#include <dtsdf_mapping/Sphere.h>
#include <geometry_msgs/Pose.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/region.h"

namespace dtsdf {

/// An orientation of all zeros is none. @throws std::runtime_error if it is not a rotation either,
/// or the position is not finite.
Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose);

/// A box of frame F in the map; nothing if the size is all zeros. @throws std::runtime_error for a
/// box with a problem, with what it is.
std::optional<BoxRegion> readBox(const dtsdf_mapping::Box& box, const Eigen::Isometry3d& T_W_F);

/// The one of both that is given, which may have a problem.
/// @throws std::runtime_error if none is, or both are; the text says what to do.
Region readRegion(const dtsdf_mapping::Box& box, const dtsdf_mapping::Sphere& sphere,
                  const Eigen::Isometry3d& T_W_F);

/// A path that may start with "~/" or be "~", the home folder.
/// @throws std::runtime_error if HOME is not set; `name` says whose path it is.
std::string expandHome(const std::string& path, const std::string& name);

/// The absolute path of a file under `output_directory`, which may start with "~/". `extensions`
/// are those that are allowed, in any case, as in {".ply", ".obj"}. What is read may lie anywhere.
/// @throws std::runtime_error if the name is empty or has control characters, lies outside the
/// directory, also by a symbolic link, or has another extension; the text says what to do.
std::string resolveOutputPath(const std::string& output_directory, const std::string& file_name,
                              const std::vector<std::string>& extensions, bool is_read = false);

}  // namespace dtsdf
