/// Reads poses, regions and file names from service requests.
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

/// Reads a pose. An all-zero orientation means the identity.
/// @throws std::runtime_error if the orientation is not a rotation or the position is not finite.
Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose);

/// Converts a box from frame F to the map's frame; none if its size is zero.
/// @throws std::runtime_error if the box is invalid.
std::optional<BoxRegion> readBox(const dtsdf_mapping::Box& box, const Eigen::Isometry3d& T_W_F);

/// The box or the sphere, whichever is given.
/// @throws std::runtime_error if none or both are given, or it is invalid.
Region readRegion(const dtsdf_mapping::Box& box, const dtsdf_mapping::Sphere& sphere,
                  const Eigen::Isometry3d& T_W_F);

/// Replaces "~" at the start of a path with the home folder.
/// @throws std::runtime_error if HOME is not set; the error text names the setting `name`.
std::string expandHome(const std::string& path, const std::string& name);

/// The absolute path of a file under `output_directory`; both may start with "~/". `extensions`
/// lists the allowed extensions in lower case, such as {".ply", ".obj"}; the name may have them in
/// upper case. If `is_read`, the file may be anywhere.
/// @throws std::runtime_error if the name is empty, has control characters or an extension that is
/// not allowed, or if the file lies outside the directory, even through a symbolic link.
std::string resolveOutputPath(const std::string& output_directory, const std::string& file_name,
                              const std::vector<std::string>& extensions, bool is_read = false);

}  // namespace dtsdf
